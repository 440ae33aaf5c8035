#include <cstdint>
#include <random>

#include <gtest/gtest.h>

#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

TEST(FrameSize, LargestFrameOfTheStandard) {
  // 1498 bytes of datagrams, one datagram with 1486 bytes of data (esc-reference 1.4).
  const Bytes packet = Plain(Payload(Datagrams({{.command = 12, .data = Bytes(1486, 0x5A), .wkc = 3}})));
  EXPECT_EQ(packet.size(), 1514U);
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_EQ(view[0].length(), 1486);
  EXPECT_EQ(view[0].data().size(), 1486U);
  EXPECT_EQ(view[0].wkc(), 3);
}

TEST(FrameSize, LargestThatTheLengthFieldCanSay) {
  // 11 bits: 2047 bytes; 2047 - 12 of data. Longer than Ethernet allows, but consistent.
  const Bytes packet = Plain(Payload(Datagrams({{.data = Bytes(2035, 1)}})));
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_EQ(view[0].length(), 2035);
}

TEST(FrameSize, SoemsFirstFrameWithClock) {
  // LRW of at most 1486 - 20 bytes and the FRMW behind it (esc-reference 1.4).
  const Bytes packet =
      Plain(Payload(Datagrams({{.command = 12, .data = Bytes(1466, 0)}, {.command = 14, .data = Bytes(8, 0)}})));
  EXPECT_EQ(packet.size(), 1514U);
  EXPECT_EQ(Parse(packet).size(), 2U);
}

TEST(FrameSize, AsManyDatagramsAsFit) {
  // Without data a datagram has 12 bytes: 124 fill a standard frame, 170 the length field.
  for (const std::size_t count : {124U, 170U}) {
    const Bytes packet =
        Plain(Payload(Datagrams(std::vector<DatagramBytes>(count, DatagramBytes{.command = 0, .data = {}}))));
    const FrameView view = Parse(packet);
    ASSERT_EQ(view.kind(), FrameKind::kEtherCat) << count;
    ASSERT_EQ(view.size(), count);
    EXPECT_EQ(view[count - 1].ordinal(), count - 1);
  }
}

TEST(FrameSize, TheLastPossibleDatagramAnnouncesAnother) {
  Bytes datagrams = Datagrams(std::vector<DatagramBytes>(170, DatagramBytes{.command = 0, .data = {}}));
  datagrams[169 * 12 + 7] |= 0x80U;
  Append(datagrams, Bytes(7, 0));
  const Bytes packet = Plain(Payload(datagrams));
  const FrameView view = Parse(packet);
  EXPECT_EQ(view.kind(), FrameKind::kMalformed);
  EXPECT_EQ(view.problem(), FrameProblem::kMoreWithoutDatagram);
}

TEST(FrameSize, JumboPacketsWithHostileLengths) {
  // Packets far longer than the length field can say: only what the header covers counts.
  Bytes packet = Plain(Payload(Datagrams({{.index = 1}})));
  packet.resize(262144, 0x0C);
  const FrameView view = Parse(packet);
  EXPECT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_EQ(view.size(), 1U);

  // A chain of datagrams that goes on behind the announced end is shown as far as its more flags go, and malformed.
  Bytes chain = Header(26);
  for (int i = 0; i < 5000; ++i) Append(chain, DatagramBytes{.index = 1, .data = {}, .flags = 0x8000}.Encode());
  const Bytes long_packet = Plain(chain);
  const FrameView chained = Parse(long_packet);
  EXPECT_EQ(chained.kind(), FrameKind::kMalformed);
  EXPECT_EQ(chained.size(), FrameView::kMaxDatagrams);

  // However long the datagrams are, all of them lie inside the packet.
  Bytes far = Header(26);
  for (int i = 0; i < 200; ++i) {
    Append(far, DatagramBytes{.index = 1, .data = Bytes(2000, 1), .flags = 0x8000}.Encode());
  }
  const Bytes far_packet = Plain(far);
  const FrameView far_view = Parse(far_packet);
  EXPECT_EQ(far_view.kind(), FrameKind::kMalformed);
  for (std::size_t i = 0; i < far_view.size(); ++i) EXPECT_EQ(far_view[i].bytes().size(), 2012U) << i;
}

TEST(FrameSize, EveryViewStaysInsideItsPacket) {
  // Random headers over random bytes: whatever is readable lies inside.
  std::mt19937 random(1);
  for (int round = 0; round < 20000; ++round) {
    Bytes packet = Plain({});
    const std::size_t length = random() % 120;
    for (std::size_t i = 0; i < length; ++i) {
      const auto r = random();
      packet.push_back(static_cast<std::uint8_t>(r % 3 == 0 ? r >> 8U : (r >> 8U) % 16));
    }
    if (packet.size() > 15) packet[15] = static_cast<std::uint8_t>(0x10U | (packet[15] & 0x07U));
    const FrameView view = Parse(packet, 1, static_cast<std::uint32_t>(packet.size() + random() % 2));
    std::size_t used = 0;
    for (std::size_t i = 0; i < view.size(); ++i) {
      ASSERT_EQ(view[i].data().size(), view[i].length());
      ASSERT_GE(view[i].bytes().data(), packet.data() + 16);
      ASSERT_LE(view[i].bytes().data() + view[i].bytes().size(), packet.data() + packet.size());
      used += view[i].bytes().size();
    }
    ASSERT_EQ(view.payload().size(), used);
    ASSERT_EQ(view.kind() == FrameKind::kMalformed, view.problem() != FrameProblem::kNone);
  }
}

}  // namespace
}  // namespace ecaudit::wire::test
