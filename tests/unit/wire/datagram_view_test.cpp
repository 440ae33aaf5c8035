#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

using ::testing::ElementsAre;

TEST(DatagramView, FieldsAreLittleEndianAtTheirOffsets) {
  // cmd, idx, adp, ado, length word, irq, data, wkc as in esc-reference 1.3.
  const Bytes packet =
      Plain({0x0F, 0x10,  //
             0x05, 0xAB, 0x34, 0x12, 0x78, 0x56, 0x03, 0x40, 0xCD, 0xEF, 0x11, 0x22, 0x33, 0xFE, 0xCA});
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat) << Describe(view.problem());
  ASSERT_EQ(view.size(), 1U);
  const DatagramView d = view[0];
  EXPECT_EQ(d.command(), Command::FPWR);
  EXPECT_EQ(d.command_byte(), 5);
  EXPECT_EQ(d.index(), 0xAB);
  EXPECT_EQ(d.adp(), 0x1234);
  EXPECT_EQ(d.ado(), 0x5678);
  EXPECT_EQ(d.logical_address(), 0x56781234U);
  EXPECT_EQ(d.length(), 3);
  EXPECT_TRUE(d.circulating());
  EXPECT_FALSE(d.more());
  EXPECT_EQ(d.irq(), 0xEFCD);
  EXPECT_THAT(d.data(), ElementsAre(0x11, 0x22, 0x33));
  EXPECT_EQ(d.wkc(), 0xCAFE);
  EXPECT_EQ(d.ordinal(), 0);
  EXPECT_EQ(d.bytes().size(), 15U);
}

TEST(DatagramView, SeveralOfDifferentLength) {
  const Bytes packet =
      Plain(Payload(Datagrams({{.command = 12, .index = 1, .adp = 0, .ado = 1, .data = Bytes(45, 0xA5), .wkc = 3},
                               {.command = 14, .index = 2, .adp = 0x1001, .ado = 0x0910, .data = Bytes(8, 1), .wkc = 4},
                               {.command = 0, .index = 3, .data = {}, .wkc = 0},
                               {.command = 7, .index = 4, .adp = 3, .ado = 0x0130, .data = {8, 0}, .wkc = 3}})));
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.kind(), FrameKind::kEtherCat) << Describe(view.problem());
  ASSERT_EQ(view.size(), 4U);
  EXPECT_EQ(view[0].command(), Command::LRW);
  EXPECT_EQ(view[0].logical_address(), 0x10000U);
  EXPECT_TRUE(view[0].more());
  EXPECT_EQ(view[1].ado(), 0x0910);
  EXPECT_EQ(view[1].wkc(), 4);
  EXPECT_EQ(view[2].command(), Command::NOP);
  EXPECT_TRUE(view[2].data().empty());
  EXPECT_EQ(view[3].ordinal(), 3);
  EXPECT_FALSE(view[3].more());
  EXPECT_THAT(view[3].data(), ElementsAre(8, 0));
  EXPECT_EQ(view.payload().size(), 57U + 20U + 12U + 14U);
}

TEST(DatagramView, AllFifteenCommandsAreAccepted) {
  for (std::uint8_t command = 0; command < 15; ++command) {
    const Bytes packet = Plain(Payload(Datagrams({{.command = command}})));
    const FrameView view = Parse(packet);
    EXPECT_EQ(view.kind(), FrameKind::kEtherCat) << int{command};
    ASSERT_EQ(view.size(), 1U);
    EXPECT_EQ(view[0].command_byte(), command);
  }
}

TEST(DatagramView, ReservedBitsOfTheLengthWordAreNoPartOfTheLength) {
  const Bytes packet = Plain(Payload(Datagrams({{.data = {1, 2}, .flags = 0x3800}})));
  const FrameView view = Parse(packet);
  ASSERT_EQ(view.size(), 1U);
  EXPECT_EQ(view[0].length(), 2);
  EXPECT_FALSE(view[0].more());
  EXPECT_FALSE(view[0].circulating());
}

TEST(FrameView, RebasedReadsTheCopy) {
  Bytes packet = Plain(Payload(Datagrams({{.data = {1, 2}}})));
  const FrameView view = Parse(packet);
  const Bytes copy = packet;
  FrameView rebased;
  rebased.Rebase(view, copy);
  packet.assign(packet.size(), 0);
  ASSERT_EQ(rebased.size(), 1U);
  EXPECT_THAT(rebased[0].data(), ElementsAre(1, 2));
  EXPECT_EQ(rebased.ref().number, 7U);
  EXPECT_EQ(rebased.payload().data(), copy.data() + 16);
}

TEST(FrameView, CarriesNumberTimeInterfaceAndFlag) {
  const Bytes packet = Plain(Payload(Datagrams({{}})));
  capture::CapturedFrame frame = Captured(packet);
  frame.number = 4711;
  frame.time = 99;
  frame.interface_index = 3;
  frame.flag = capture::PacketFlag::kOutbound;
  const FrameView view = FrameView::Parse(frame);
  EXPECT_EQ(view.ref().number, 4711U);
  EXPECT_EQ(view.ref().time, 99);
  EXPECT_TRUE(view.ref().has_time);
  EXPECT_EQ(view.interface_index(), 3);
  EXPECT_EQ(view.flag(), capture::PacketFlag::kOutbound);
}

}  // namespace
}  // namespace ecaudit::wire::test
