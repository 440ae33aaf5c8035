#include <gtest/gtest.h>

#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

Bytes OneDatagram() {
  return Payload(Datagrams({{.command = 5, .index = 0x5A, .adp = 0x1001, .ado = 0x0120, .data = {2, 0}, .wkc = 1}}));
}

void ExpectTheDatagram(const FrameView& view) {
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat) << Describe(view.problem());
  EXPECT_EQ(view.problem(), FrameProblem::kNone);
  EXPECT_TRUE(view.has_ethercat_header());
  EXPECT_EQ(view.ethercat_type(), 1);
  ASSERT_EQ(view.size(), 1U);
  EXPECT_EQ(view[0].index(), 0x5A);
  EXPECT_EQ(view[0].ado(), 0x0120);
  EXPECT_EQ(view[0].wkc(), 1);
}

/// IPv4 header of 20 bytes plus `options`, UDP header, then `payload`.
struct Ip {
  std::uint8_t version = 4;
  Bytes options{};
  std::uint16_t fragment = 0;  ///< flags and offset
  std::uint8_t protocol = 17;
  std::uint16_t source_port = 34980;
  std::uint16_t destination_port = 34980;

  [[nodiscard]] Bytes Encode(const Bytes& payload) const {
    const auto byte = [](std::size_t v) { return static_cast<std::uint8_t>(v & 0xFFU); };
    const std::size_t total = 28 + options.size() + payload.size();
    Bytes out{byte(static_cast<std::size_t>(version << 4U) | (5 + options.size() / 4)),
              0,
              byte(total >> 8U),
              byte(total),
              0,
              0,
              byte(fragment >> 8U),
              byte(fragment),
              64,
              protocol,
              0,
              0,
              10,
              0,
              0,
              1,
              255,
              255,
              255,
              255};
    Append(out, options);
    const std::size_t udp = 8 + payload.size();
    Append(out, {byte(source_port >> 8U), byte(source_port), byte(destination_port >> 8U), byte(destination_port),
                 byte(udp >> 8U), byte(udp), 0, 0});
    Append(out, payload);
    return out;
  }
};

TEST(Encapsulation, EthernetAndItsSourceAddress) {
  const Bytes packet = Ethernet(kEtherCatType, OneDatagram(), {0x01, 0x02, 0x03, 0x04, 0x05, 0x06});
  const FrameView view = Parse(packet);
  ExpectTheDatagram(view);
  EXPECT_EQ(view.encapsulation(), Encapsulation::kEthernet);
  EXPECT_EQ(view.vlan_tags(), 0);
  EXPECT_EQ(view.source_mac(), 0x010203040506U);
  EXPECT_FALSE(view.mac_bit());
}

TEST(Encapsulation, OnlyBitOneOfTheFirstByteIsTheMacBit) {
  for (unsigned first = 0; first < 256; ++first) {
    const Bytes packet =
        Ethernet(kEtherCatType, OneDatagram(), {static_cast<std::uint8_t>(first), 0xFF, 0xFF, 0xFF, 0xFF, 0xFF});
    EXPECT_EQ(Parse(packet).mac_bit(), (first & 2U) != 0) << first;
  }
}

TEST(Encapsulation, SlavesThatExchangeAddressesSendBackToTheMaster) {
  const auto parsed = [](const Bytes& destination, const Bytes& source) {
    Bytes packet = Ethernet(kEtherCatType, OneDatagram());
    std::ranges::copy(destination, packet.begin());
    std::ranges::copy(source, packet.begin() + 6);
    return Parse(packet).source_mac();
  };
  const Bytes kMaster{0xC8, 0xF7, 0x50, 0x50, 0xA0, 0xFF};
  const Bytes kGroup{0x01, 0x01, 0x05, 0x01, 0x00, 0x00};
  EXPECT_EQ(parsed(kMaster, kGroup), 0xCAF75050A0FFU);
  EXPECT_EQ(parsed(kGroup, kMaster), 0xC8F75050A0FFU);
  // SOEM sends from a group's address.
  EXPECT_EQ(parsed(Bytes(6, 0xFF), Bytes(6, 0x01)), 0x010101010101U);
  EXPECT_EQ(parsed(kGroup, Bytes(6, 0x01)), 0x010101010101U);
  EXPECT_EQ(parsed(Bytes(6, 0x00), Bytes(6, 0x01)), 0x010101010101U);
}

TEST(Encapsulation, VlanTags) {
  const struct {
    Bytes tags;
    std::uint8_t count;
  } cases[] = {
      {{0x81, 0x00, 0x60, 0x05, 0x88, 0xA4}, 1},
      {{0x88, 0xA8, 0x00, 0x07, 0x81, 0x00, 0x60, 0x05, 0x88, 0xA4}, 2},
      {{0x91, 0x00, 0x00, 0x07, 0x81, 0x00, 0x60, 0x05, 0x88, 0xA4}, 2},
      {{0x81, 0x00, 0x00, 0x07, 0x81, 0x00, 0x60, 0x05, 0x88, 0xA4}, 2},
  };
  for (const auto& c : cases) {
    const Bytes packet = Ethernet(c.tags, OneDatagram());
    const FrameView view = Parse(packet);
    ExpectTheDatagram(view);
    EXPECT_EQ(view.vlan_tags(), c.count);
  }
}

TEST(Encapsulation, TagsWithoutEndAreNoEtherCat) {
  Bytes tags;
  for (int i = 0; i < 40; ++i) Append(tags, {0x81, 0x00, 0x00, 0x01});
  const Bytes packet = Ethernet(tags, OneDatagram());
  EXPECT_EQ(Parse(packet).kind(), FrameKind::kOther);
}

TEST(Encapsulation, Udp) {
  const Bytes packet = Ethernet({0x08, 0x00}, Ip{}.Encode(OneDatagram()));
  const FrameView view = Parse(packet);
  ExpectTheDatagram(view);
  EXPECT_EQ(view.encapsulation(), Encapsulation::kUdp);
}

TEST(Encapsulation, UdpAfterVlanAndIpOptions) {
  for (std::size_t words = 1; words <= 10; ++words) {
    const Bytes ip = Ip{.options = Bytes(words * 4, 0x01)}.Encode(OneDatagram());
    const Bytes packet = Ethernet({0x81, 0x00, 0x00, 0x05, 0x08, 0x00}, ip);
    const FrameView view = Parse(packet);
    ExpectTheDatagram(view);
    EXPECT_EQ(view.encapsulation(), Encapsulation::kUdp);
    EXPECT_EQ(view.vlan_tags(), 1);
  }
}

TEST(Encapsulation, OneUdpPortIsEnough) {
  const Bytes to = Ethernet({0x08, 0x00}, Ip{.source_port = 50000}.Encode(OneDatagram()));
  ExpectTheDatagram(Parse(to));
  const Bytes from = Ethernet({0x08, 0x00}, Ip{.destination_port = 50000}.Encode(OneDatagram()));
  ExpectTheDatagram(Parse(from));
}

TEST(Encapsulation, OtherIpPacketsAreNoEtherCat) {
  const Bytes wrong_port = Ethernet({0x08, 0x00}, Ip{.source_port = 53, .destination_port = 53}.Encode(OneDatagram()));
  EXPECT_EQ(Parse(wrong_port).kind(), FrameKind::kOther);
  const Bytes tcp = Ethernet({0x08, 0x00}, Ip{.protocol = 6}.Encode(OneDatagram()));
  EXPECT_EQ(Parse(tcp).kind(), FrameKind::kOther);
  const Bytes six = Ethernet({0x08, 0x00}, Ip{.version = 6}.Encode(OneDatagram()));
  EXPECT_EQ(Parse(six).kind(), FrameKind::kOther);
  Bytes short_header = Ip{}.Encode(OneDatagram());
  short_header[0] = 0x44;  // header length 16: not allowed
  const Bytes malformed = Ethernet({0x08, 0x00}, short_header);
  EXPECT_EQ(Parse(malformed).kind(), FrameKind::kOther);
}

TEST(Encapsulation, FragmentsAreNotRead) {
  for (const int fragment : {0x2000, 0x0001, 0x1FFF, 0x2005}) {
    const Bytes packet =
        Ethernet({0x08, 0x00}, Ip{.fragment = static_cast<std::uint16_t>(fragment)}.Encode(OneDatagram()));
    EXPECT_EQ(Parse(packet).kind(), FrameKind::kOther) << fragment;
  }
  // "Do not fragment" is no fragment.
  const Bytes whole = Ethernet({0x08, 0x00}, Ip{.fragment = 0x4000}.Encode(OneDatagram()));
  ExpectTheDatagram(Parse(whole));
}

TEST(Encapsulation, IpThatEndsEarly) {
  const Bytes packet = Ethernet({0x08, 0x00}, Ip{.options = Bytes(8, 1)}.Encode(OneDatagram()));
  for (std::size_t length = 0; length < 14 + 20 + 8 + 8; ++length) {
    const Bytes shorter(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_EQ(Parse(shorter).kind(), FrameKind::kOther) << length;
  }
}

// packet type, ARPHRD, address length, address (8 bytes), EtherType: all big endian.
Bytes Cooked(std::uint8_t packet_type, const Bytes& behind) {
  Bytes out{0, packet_type, 0, 1, 0, 6, 0x03, 0x01, 0x01, 0x01, 0x01, 0x01, 0, 0};
  Append(out, behind);
  return out;
}
// EtherType, reserved, interface, ARPHRD, packet type, address length, address (8 bytes).
Bytes Cooked2(std::uint8_t packet_type, const Bytes& type, const Bytes& rest) {
  Bytes out = type;
  Append(out, {0, 0, 0, 0, 0, 9, 0, 1, packet_type, 6, 0x03, 0x01, 0x01, 0x01, 0x01, 0x01, 0, 0});
  Append(out, rest);
  return out;
}

TEST(Encapsulation, LinuxCooked) {
  Bytes behind = kEtherCatType;
  Append(behind, OneDatagram());
  for (std::uint8_t type = 0; type <= 4; ++type) {
    const Bytes packet = Cooked(type, behind);
    const FrameView view = Parse(packet, 113);
    ExpectTheDatagram(view);
    EXPECT_EQ(view.flag(), type == 4 ? capture::PacketFlag::kOutbound : capture::PacketFlag::kInbound) << int{type};
    EXPECT_EQ(view.source_mac(), 0x030101010101U);
    EXPECT_TRUE(view.mac_bit());
  }
}

TEST(Encapsulation, LinuxCookedWithTagAndUdp) {
  Bytes tagged{0x81, 0x00, 0x00, 0x05, 0x88, 0xA4};
  Append(tagged, OneDatagram());
  const Bytes packet = Cooked(4, tagged);
  ExpectTheDatagram(Parse(packet, 113));
  Bytes udp{0x08, 0x00};
  Append(udp, Ip{}.Encode(OneDatagram()));
  const Bytes udp_packet = Cooked(4, udp);
  ExpectTheDatagram(Parse(udp_packet, 113));
}

TEST(Encapsulation, LinuxCooked2) {
  for (std::uint8_t type = 0; type <= 4; ++type) {
    const Bytes packet = Cooked2(type, kEtherCatType, OneDatagram());
    const FrameView view = Parse(packet, 276);
    ExpectTheDatagram(view);
    EXPECT_EQ(view.flag(), type == 4 ? capture::PacketFlag::kOutbound : capture::PacketFlag::kInbound) << int{type};
    EXPECT_EQ(view.source_mac(), 0x030101010101U);
  }
  Bytes tag{0x00, 0x05, 0x88, 0xA4};
  Append(tag, OneDatagram());
  const Bytes tagged = Cooked2(0, {0x81, 0x00}, tag);
  const FrameView view = Parse(tagged, 276);
  ExpectTheDatagram(view);
  EXPECT_EQ(view.vlan_tags(), 1);
}

TEST(Encapsulation, TheFlagOfTheFileWinsOverTheCookedPacketType) {
  Bytes behind = kEtherCatType;
  Append(behind, OneDatagram());
  const Bytes packet = Cooked(4, behind);
  capture::CapturedFrame frame = Captured(packet, 113);
  frame.flag = capture::PacketFlag::kInbound;
  EXPECT_EQ(FrameView::Parse(frame).flag(), capture::PacketFlag::kInbound);
}

TEST(Encapsulation, OtherLinkTypesAreNotDecoded) {
  const Bytes packet = Plain(OneDatagram());
  for (const int link : {0, 12, 101, 105, 127, 228, 0xFFFF}) {
    EXPECT_EQ(Parse(packet, static_cast<std::uint16_t>(link)).kind(), FrameKind::kOther) << link;
  }
}

TEST(Encapsulation, OtherEtherTypesAreNoEtherCat) {
  for (const int type : {0x0806, 0x86DD, 0x88CC, 0x88A3, 0x88A5, 0xA488, 0x0000, 0xFFFF}) {
    const Bytes packet =
        Ethernet({static_cast<std::uint8_t>(type >> 8), static_cast<std::uint8_t>(type & 0xFF)}, OneDatagram());
    EXPECT_EQ(Parse(packet).kind(), FrameKind::kOther) << type;
  }
}

TEST(Encapsulation, EtherCatTypesOtherThanCommandsAreSkippedWithoutError) {
  for (std::uint8_t type = 0; type < 16; ++type) {
    if (type == 1) continue;
    const Bytes packet = Plain(Payload(Datagrams({{.command = 0xEE, .flags = 0x8000}}), type));
    const FrameView view = Parse(packet);
    EXPECT_EQ(view.kind(), FrameKind::kOther) << int{type};
    EXPECT_EQ(view.problem(), FrameProblem::kNone);
    EXPECT_EQ(view.ethercat_type(), type);
    EXPECT_TRUE(view.has_ethercat_header());
    EXPECT_TRUE(view.empty());
  }
}

TEST(Encapsulation, EmptyAndTinyPackets) {
  for (const int link : {1, 113, 276}) {
    for (std::size_t length = 0; length < 12; ++length) {
      const Bytes packet(length, 0xA4);
      EXPECT_EQ(Parse(packet, static_cast<std::uint16_t>(link)).kind(), FrameKind::kOther) << link << " " << length;
    }
  }
}

}  // namespace
}  // namespace ecaudit::wire::test
