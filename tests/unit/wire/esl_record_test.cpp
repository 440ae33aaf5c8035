#include <gtest/gtest.h>

#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

/// esc-reference 1.5: cookie, flags, time stamp, both little endian.
Bytes Record(std::uint16_t flags, std::uint64_t time = 0x0102030405060708ULL, std::uint8_t variant = 0x10) {
  Bytes out{0x01,
            0x01,
            0x05,
            variant,
            0x00,
            0x00,
            static_cast<std::uint8_t>(flags & 0xFFU),
            static_cast<std::uint8_t>(flags >> 8U)};
  for (unsigned i = 0; i < 8; ++i) out.push_back(static_cast<std::uint8_t>(time >> (8 * i) & 0xFFU));
  return out;
}

Bytes Frame() {
  Bytes out = Plain(Payload(Datagrams({{.command = 4, .index = 9, .wkc = 1}})));
  out.resize(60, 0);
  return out;
}

Bytes InFront(const Bytes& record) {
  Bytes out = record;
  Append(out, Frame());
  return out;
}
Bytes Behind(const Bytes& record) {
  Bytes out = Frame();
  Append(out, record);
  return out;
}

TEST(EslRecord, InFrontOfTheFrame) {
  const Bytes packet = InFront(Record(0x2080));
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_TRUE(view.esl().present);
  EXPECT_EQ(view.esl().port, 0);
  EXPECT_TRUE(view.esl().has_time);
  EXPECT_EQ(view.esl().time_ns, 0x0102030405060708ULL);
  EXPECT_FALSE(view.esl().crc_error);
  EXPECT_FALSE(view.esl().alignment_error);
  EXPECT_EQ(view[0].index(), 9);
  EXPECT_EQ(view.source_mac(), 0x021122334455U);
}

TEST(EslRecord, AfterTheFrame) {
  const Bytes packet = Behind(Record(0x2040));
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_TRUE(view.esl().present);
  EXPECT_EQ(view.esl().port, 1);
  EXPECT_EQ(view[0].index(), 9);
}

TEST(EslRecord, BothVariantsOfTheCookie) {
  const Bytes packet = InFront(Record(0x0080, 0, 0x11));
  EXPECT_TRUE(Parse(packet).esl().present);
  const Bytes other = InFront(Record(0x0080, 0, 0x12));
  EXPECT_FALSE(Parse(other).esl().present);
}

TEST(EslRecord, EveryPortBit) {
  constexpr std::uint16_t kBits[] = {0x0080, 0x0040, 0x0020, 0x0010, 0x0008, 0x0004,
                                     0x0002, 0x0001, 0x8000, 0x4000, 0x0400, 0x0200};
  for (std::uint8_t port = 0; port < 12; ++port) {
    const Bytes front = InFront(Record(kBits[port]));
    EXPECT_EQ(Parse(front).esl().port, port);
    EXPECT_FALSE(Parse(front).esl().has_time);
    const Bytes behind = Behind(Record(static_cast<std::uint16_t>(kBits[port] | 0x0100U)));
    EXPECT_EQ(Parse(behind).esl().port, port);
  }
}

TEST(EslRecord, FramesWithErrorsAreDamagedAndNotMalformed) {
  const Bytes crc = Behind(Record(0x1080));
  EXPECT_EQ(Parse(crc).kind(), FrameKind::kDamagedOnWire);
  EXPECT_TRUE(Parse(crc).esl().crc_error);
  const Bytes alignment = InFront(Record(0x0880));
  EXPECT_EQ(Parse(alignment).kind(), FrameKind::kDamagedOnWire);
  EXPECT_TRUE(Parse(alignment).esl().alignment_error);

  // What stands in a damaged frame is nobody's fault.
  Bytes headless = Plain({});
  Append(headless, Record(0x1080));
  EXPECT_EQ(Parse(headless).kind(), FrameKind::kDamagedOnWire);
  Bytes nonsense = Plain(Payload(Datagrams({{.command = 0x77, .flags = 0x8000}})));
  Append(nonsense, Record(0x1080));
  EXPECT_EQ(Parse(nonsense).kind(), FrameKind::kDamagedOnWire);
}

TEST(EslRecord, DamagedFramesOfOtherProtocolsStayOther) {
  Bytes arp = Ethernet({0x08, 0x06}, Bytes(46, 0));
  Append(arp, Record(0x1080));
  EXPECT_EQ(Parse(arp).kind(), FrameKind::kOther);
  Bytes variables = Plain(Payload(Bytes(40, 0), 4));
  Append(variables, Record(0x1080));
  EXPECT_EQ(Parse(variables).kind(), FrameKind::kOther);
}

TEST(EslRecord, IsNoPartOfTheFrame) {
  // The EtherCAT length reaches into the record: beyond the frame.
  Bytes packet = Plain(Header(40));
  Append(packet, DatagramBytes{.data = Bytes(28, 0)}.Encode());
  packet.resize(14 + 2 + 30);
  Append(packet, Record(0x0080));
  const FrameView view = Parse(packet);
  EXPECT_EQ(view.kind(), FrameKind::kMalformed);
  EXPECT_EQ(view.problem(), FrameProblem::kLengthBeyondFrame);
}

TEST(EslRecord, OnlyOnEthernet) {
  Bytes packet{0, 4, 0, 1, 0, 6, 0x03, 0x01, 0x01, 0x01, 0x01, 0x01, 0, 0, 0x88, 0xA4};
  Append(packet, Payload(Datagrams({{}})));
  Append(packet, Record(0x1080));
  const FrameView view = Parse(packet, 113);
  EXPECT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_FALSE(view.esl().present);
}

TEST(EslRecord, AloneOrCutShort) {
  const Bytes alone = Record(0x1080);
  EXPECT_EQ(Parse(alone).kind(), FrameKind::kOther);
  for (std::size_t length = 0; length < 16; ++length) {
    const Bytes record = Record(0x1080);
    const Bytes part(record.begin(), record.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_FALSE(Parse(part).esl().present) << length;
  }
}

}  // namespace
}  // namespace ecaudit::wire::test
