#include <gtest/gtest.h>

#include "decoder/wire/frame_parser.h"
#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

constexpr std::uint16_t kLink = 240;

Bytes Word(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value & 0xFFU), static_cast<std::uint8_t>(value >> 8U & 0xFFU),
          static_cast<std::uint8_t>(value >> 16U & 0xFFU), static_cast<std::uint8_t>(value >> 24U & 0xFFU)};
}

/// Header, frame of 60 bytes and four bytes of FCS.
Bytes Recorded(unsigned port, unsigned errors = 0, const Bytes& preamble = {}, std::uint32_t more = 0) {
  Bytes frame = Plain(Payload(Datagrams({{.command = 4, .index = 9, .wkc = 1}})));
  frame.resize(60, 0);
  Bytes out = Word(errors | 1U << 10U | port << 14U | 64U << 16U | more);
  Append(out, preamble);
  Append(out, frame);
  Append(out, {0xDE, 0xAD, 0xBE, 0xEF});
  return out;
}

TEST(NetAnalyzer, FrameWithoutHeaderAndFcs) {
  const Bytes packet = Recorded(2);
  const FrameView view = Parse(packet, kLink);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_TRUE(view.esl().present);
  EXPECT_FALSE(view.esl().has_time);
  EXPECT_EQ(view.esl().port, 2);
  EXPECT_EQ(view.bytes().size(), 60U);
  EXPECT_EQ(view[0].index(), 9);
  EXPECT_EQ(view.source_mac(), 0x021122334455U);
}

TEST(NetAnalyzer, ErrorFlagsOfTheCard) {
  for (const unsigned damage : {0x01U, 0x02U, 0x04U, 0x10U}) {
    const Bytes packet = Recorded(0, damage);
    EXPECT_EQ(Parse(packet, kLink).kind(), FrameKind::kDamagedOnWire) << damage;
  }
  for (const unsigned harmless : {0x20U, 0x40U, 0x80U}) {
    const Bytes packet = Recorded(0, harmless);
    EXPECT_EQ(Parse(packet, kLink).kind(), FrameKind::kEtherCat) << harmless;
  }
}

TEST(NetAnalyzer, PreambleOfTheTransparentMode) {
  const Bytes packet = Recorded(1, 0, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0xD5}, 1U << 9U);
  const FrameView view = Parse(packet, 241);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_EQ(view.bytes().size(), 60U);
  EXPECT_EQ(view.esl().port, 1);
}

TEST(NetAnalyzer, EventOfAnInputIsNoFrame) {
  const Bytes packet = Recorded(1, 0, {}, 1U << 8U);
  const FrameView view = Parse(packet, kLink);
  EXPECT_EQ(view.kind(), FrameKind::kOther);
  EXPECT_FALSE(view.cut_before_type()) << "it misses nothing";
  EXPECT_FALSE(view.esl().present);
}

TEST(NetAnalyzer, AnyCutIsNoCrash) {
  const Bytes packet = Recorded(0);
  for (std::size_t size = 0; size <= packet.size(); ++size) {
    const Bytes cut(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(size));
    const FrameView view = Parse(cut, kLink, static_cast<std::uint32_t>(packet.size()));
    EXPECT_LE(view.bytes().size(), 60U);
    const FrameView whole = Parse(cut, kLink);
    EXPECT_LE(whole.bytes().size(), size);
  }
}

TEST(NetAnalyzer, FcsOfPlainEthernetIsNoPartOfTheFrame) {
  Bytes packet = Recorded(0);
  packet.erase(packet.begin(), packet.begin() + 4);
  capture::CapturedFrame frame = Captured(packet);
  frame.fcs_bytes = 4;
  EXPECT_EQ(FrameView::Parse(frame).bytes().size(), 60U);
  FrameParser parser;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(parser.Parse(frame).bytes().size(), 60U);
}

}  // namespace
}  // namespace ecaudit::wire::test
