#include "decoder/bus/direction.h"

#include <gmock/gmock.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr samples::MacAddress kBitSet{0x02, 0xAB, 0x01, 0x01, 0x01, 0x01};

/// Addressing one slave after the other by position, as every start-up does: the position counter runs through 0.
void AddScan(Trace& trace, std::uint16_t slaves) {
  trace.Slaves(slaves);
  trace.After(100).Brd(0x0000, {0x11, 0});
  trace.After(100).Bwr(0x0120, {0x11, 0});
  for (std::uint16_t position = 0; position < slaves; ++position) {
    trace.After(100).Aprd(position, 0x0140, {0x05, 0x0C});
    trace.After(100).Apwr(position, 0x0010, {static_cast<std::uint8_t>(position + 1), 0x10});
    trace.After(100).Fprd(static_cast<std::uint16_t>(0x1001 + position), 0x0130, {1, 0});
  }
}

std::string Alternating(std::size_t pairs) {
  std::string out;
  for (std::size_t i = 0; i < pairs; ++i) out += "or";
  return out;
}

constexpr samples::MacAddress kOtherMaster{0x10, 0x20, 0x20, 0x20, 0x20, 0x20};

/// Two masters whose frames take turns: of three slaves and of `other` ones.
Paired TwoMasters(std::uint16_t other, std::uint8_t index_step) {
  Trace trace;
  for (int i = 0; i < 60; ++i) {
    const auto index = static_cast<std::uint8_t>(i);
    trace.Mac(samples::MacAddress{0x00, 1, 2, 3, 4, 5}).Slaves(3);
    trace.After(100).Brd(0x0130, {1, 0}).Index(index);
    trace.After(100).Brd(0x0110, {1, 0}).Index(index);
    trace.Mac(kOtherMaster).Slaves(other);
    trace.After(100).Brd(0x0130, {1, 0}).Index(static_cast<std::uint8_t>(index + index_step));
  }
  return PairUp(trace);
}

TEST(Direction, AnotherBusIsIgnored) {
  const Paired result = TwoMasters(2, 100);
  EXPECT_EQ(result.statistics.foreign, 120U);
  EXPECT_EQ(result.statistics.foreign_answered, 60U);
  EXPECT_EQ(result.statistics.paired, 120U);
}

TEST(Direction, AsManySlavesMayBeTheSameOnes) {
  EXPECT_EQ(TwoMasters(3, 100).statistics.foreign, 0U);
}

TEST(Direction, TheSameIndicesAreOneMaster) {
  // Both ends of a redundant line that is broken somewhere.
  EXPECT_EQ(TwoMasters(2, 0).statistics.foreign, 0U);
}

TEST(Direction, ByTheMacBit) {
  Trace trace;
  AddScan(trace, 3);
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.log.directions, Alternating(11));
  EXPECT_EQ(result.statistics.paired, 11U);
  EXPECT_FALSE(result.outbound_only);
  EXPECT_FALSE(result.returned_only);
}

TEST(Direction, MastersOwnMacHasTheBit) {
  // KickCAT (captures of it show 02:..); with several slaves the position counter runs from 0xFFFF through 0.
  for (const std::uint16_t slaves : {std::uint16_t{1}, std::uint16_t{2}, std::uint16_t{3}, std::uint16_t{40}}) {
    Trace trace;
    trace.Mac(kBitSet);
    AddScan(trace, slaves);
    const Paired result = PairUp(trace);
    EXPECT_EQ(result.log.directions, Alternating(2U + 3U * slaves)) << slaves;
    EXPECT_EQ(result.statistics.paired, 2U + 3U * slaves);
    EXPECT_EQ(result.statistics.lost, 0U);
  }
}

TEST(Direction, NoSlaveSetsTheBit) {
  // A simulated bus may return frames with the master's address as it is.
  Trace trace;
  AddScan(trace, 3);
  std::vector<Packet> packets = trace.Packets();
  for (Packet& packet : packets) packet.bytes[6] = static_cast<std::uint8_t>(packet.bytes[6] & ~2U);
  const Paired result = PairUp(packets);
  EXPECT_EQ(result.log.directions, Alternating(11));
  EXPECT_EQ(result.statistics.paired, 11U);
}

TEST(Direction, UnansweredPollsOfAMasterWithTheBit) {
  // A mailbox poll with working counter 0 comes back as it was sent.
  Trace trace;
  trace.Mac(kBitSet);
  AddScan(trace, 2);
  for (int i = 0; i < 20; ++i) trace.After(500).Fprd(0x1001, 0x1C00, Bytes(8, 0)).Wkc(0);
  trace.After(500).Fprd(0x1001, 0x1C00, Bytes(8, 1)).Wkc(1);
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.log.directions, Alternating(8 + 21));
  EXPECT_EQ(result.statistics.paired, 29U);
}

TEST(Direction, OnlyOutbound) {
  for (const bool bit : {false, true}) {
    Trace trace;
    if (bit) trace.Mac(kBitSet);
    trace.Direction(ecaudit::test::Copies::kOutbound);
    AddScan(trace, 2);
    const Paired result = PairUp(trace);
    EXPECT_TRUE(result.outbound_only) << bit;
    EXPECT_FALSE(result.returned_only);
    EXPECT_EQ(result.log.directions, std::string(8, 'o')) << bit;
    EXPECT_THAT(result.log.words, ElementsAre("1?", "2?", "3?", "4?", "5?", "6?", "7?", "8?"));
    EXPECT_THAT(result.log.sent, IsEmpty()) << "not called when assumed transactions follow at once";
  }
}

TEST(Direction, OnlyReturned) {
  Trace trace;
  trace.Direction(ecaudit::test::Copies::kReturned);
  AddScan(trace, 2);
  const Paired result = PairUp(trace);
  EXPECT_TRUE(result.returned_only);
  EXPECT_EQ(result.log.directions, std::string(8, 'r'));
  EXPECT_EQ(result.statistics.unmatched_returned, 8U);
  EXPECT_THAT(result.log.words, ElementsAre("+1", "+2", "+3", "+4", "+5", "+6", "+7", "+8"));
}

TEST(Direction, OnlyReturnedOfAMasterWithSixteenIndices) {
  // The same sixteen indices again and again: equal frames, none of them a copy of another (SOEM).
  Trace trace;
  trace.Direction(ecaudit::test::Copies::kReturned);
  for (int i = 0; i < 500; ++i) {
    // Working counters differ while slaves start up.
    const auto wkc = static_cast<std::uint16_t>(i < 100 ? 0 : i < 150 ? 1 : 3);
    trace.After(1000)
        .Lrw(0x10000, Bytes(8, 0), Bytes(8, static_cast<std::uint8_t>(i)))
        .Wkc(wkc)
        .Index(static_cast<std::uint8_t>(i % 16));
    if (i % 10 == 0) trace.After(10).Brd(0x0130, {4, 0}).Index(static_cast<std::uint8_t>(i % 16));
  }
  const Paired result = PairUp(trace);
  EXPECT_TRUE(result.returned_only);
  EXPECT_EQ(result.statistics.unmatched_returned, 550U);
  EXPECT_EQ(result.statistics.duplicated, 0U);
}

TEST(Direction, ByWhatTheFileReports) {
  // Linux cooked capture on the master: packet type 4 is what the machine itself sent.
  Trace trace;
  trace.Mac(kBitSet);
  trace.Around({.link = samples::Link::kCooked});
  AddScan(trace, 2);
  for (int i = 0; i < 10; ++i) trace.After(500).Fprd(0x1001, 0x1C00, Bytes(8, 0)).Wkc(0).Index(7);
  // Lost, then repeated: the copy must not be taken for the return.
  trace.After(500).Fprd(0x1001, 0x0130, {2, 0}).Index(9).Lost();
  trace.After(500).Fprd(0x1001, 0x0130, {2, 0}).Index(9);
  trace.After(500).Fprd(0x1001, 0x0134, {0, 0});
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.log.directions, Alternating(18) + "o" + Alternating(2));
  EXPECT_EQ(result.statistics.paired, 20U);
  EXPECT_EQ(result.statistics.lost, 1U);
}

TEST(Direction, ByTheInterface) {
  Result<Trace> trace = Trace::Parse(R"(
@mac 02:00:00:00:00:01
@slaves 2
@two-interfaces
+0us   BRD 0x0000 11 00
+1ms   APRD 0:0x0110 13 56
+1ms   APRD 1:0x0110 13 56
+1ms   FPRD 0x1001:0x0130 02 00 idx=5
+1ms   FPRD 0x1001:0x0130 02 00 idx=5 @lost
+1ms   FPRD 0x1001:0x0130 02 00 idx=5
+1ms   FPRD 0x1001:0x1C00 len=8 wkc=0 idx=6
)");
  ASSERT_TRUE(trace.has_value());
  const Paired result = PairUp(*trace);
  EXPECT_EQ(result.log.directions,
            "orororor"
            "o"
            "oror");
  EXPECT_EQ(result.statistics.paired, 6U);
}

TEST(Direction, ByTheProbesPort) {
  // A probe records port 0 (to the slaves) and port 1 (back) and the master's address has the bit set.
  Trace trace;
  trace.Mac(kBitSet);
  AddScan(trace, 2);
  for (int i = 0; i < 10; ++i) trace.After(500).Fprd(0x1001, 0x1C00, Bytes(8, 0)).Wkc(0).Index(7);
  std::vector<Packet> packets = trace.Packets();
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const std::uint8_t port_bit = i % 2 == 0 ? 0x80 : 0x40;
    const std::uint8_t record[16] = {0x01, 0x01, 0x05, 0x10, 0, 0, port_bit, 0x20};
    packets[i].bytes.insert(packets[i].bytes.end(), std::begin(record), std::end(record));
  }
  packets.erase(packets.begin() + 17);  // one unanswered poll lost: the next one must not pass for its return
  const Paired result = PairUp(packets);
  EXPECT_EQ(result.log.directions, Alternating(8) + "o" + Alternating(9));
  EXPECT_EQ(result.statistics.paired, 17U);
}

TEST(Direction, LateSendersWithTheBitAreForeign) {
  // mixed-traffic: another sender whose address has the bit set although its frames are no returned ones.
  Trace trace;
  AddScan(trace, 2);
  trace.Mac({0x02, 0x00, 0xC0, 0xFF, 0xEE, 0x01});
  trace.After(100).Fpwr(0x1001, 0x0120, {8, 0}).Lost();
  trace.After(100).Fpwr(0x1001, 0x0120, {4, 0}).ReturnedOnly();  // even with a working counter
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.log.directions, Alternating(8) + "ff");
  EXPECT_EQ(result.statistics.foreign, 2U);
  EXPECT_EQ(result.statistics.paired, 8U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(Direction, LateSendersWithoutTheBitAreForeignToo) {
  // Frames of another bus's master that leak in and are never answered.
  Trace trace;
  AddScan(trace, 2);
  trace.Mac({0x10, 0x10, 0x10, 0x10, 0x10, 0x10});
  for (int i = 0; i < 50; ++i) trace.After(100).Fpwr(0x1001, 0x0120, {8, 0}).Lost();
  trace.Mac({0x01, 0x01, 0x01, 0x01, 0x01, 0x01});
  AddScan(trace, 2);
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.foreign, 50U);
  EXPECT_EQ(result.statistics.paired, 16U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(Direction, ASenderThatShowsUpLater) {
  // Two masters one after the other, the second behind the look-ahead.
  Trace trace;
  AddScan(trace, 2);
  trace.Mac({0x00, 0x00, 0x00, 0x00, 0x00, 0x00});
  AddScan(trace, 2);
  const Paired result = PairUp(trace, 16);
  EXPECT_EQ(result.statistics.paired, 16U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.unmatched_returned, 0U);
}

TEST(Direction, ASenderThatJoinsLateLosesNothing) {
  Trace trace;
  AddScan(trace, 2);
  trace.Mac({0x10, 0x10, 0x10, 0x10, 0x10, 0x10});
  for (int i = 0; i < 300; ++i) trace.After(100).Lrw(0, Bytes(4, 0), Bytes(4, 0)).Lost();
  trace.Mac({0x01, 0x01, 0x01, 0x01, 0x01, 0x01});
  AddScan(trace, 2);
  const Paired result = PairUp(trace, 16);
  EXPECT_EQ(result.statistics.paired, 16U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(Direction, NothingComesBackForAWhileAndThenDoes) {
  // More unanswered frames than the look-ahead holds, for example while the slaves are switched on.
  for (const bool bit : {false, true}) {
    Trace trace;
    if (bit) trace.Mac(kBitSet);
    for (int i = 0; i < 40; ++i) trace.After(1000).Brd(0x0130, {0, 0}).Lost();
    AddScan(trace, 2);
    for (int i = 0; i < 20; ++i) trace.After(1000).Fprd(0x1001, 0x1C00, Bytes(8, 0)).Wkc(0);
    const Paired result = PairUp(trace, 20);
    EXPECT_EQ(result.statistics.lost, 0U) << bit;
    EXPECT_GE(result.statistics.paired, 27U) << bit;
    EXPECT_LE(result.statistics.unmatched_returned, 1U) << bit;
  }
}

TEST(Direction, MoreSendersThanAnyBusHas) {
  Trace trace;
  for (int i = 0; i < 100; ++i) {
    trace.Mac({0x10, 0, 0, 0, 0, static_cast<std::uint8_t>(i)});
    trace.After(100).Fprd(0x1001, 0x0130, {1, 0});
    trace.After(100).Fprd(0x1001, 0x0130, {1, 0}).Lost();
    trace.After(100).Fprd(0x1001, 0x0130, {1, 0}).ReturnedOnly();
  }
  const Paired result = PairUp(trace);
  EXPECT_GE(result.statistics.paired, 100U);
}

TEST(Direction, KeyIgnoresOnlyWhatSlavesChange) {
  Trace trace;
  trace.Slaves(3);
  trace.At(0).Brd(0x0130, {1, 0}).Fprd(0x1001, 0x0130, {1, 2}).Lrw(0x1234, {1, 2}, {3, 4}).Armw(0, 0x0910, Bytes(4, 9));
  const std::vector<Packet> packets = trace.Packets();
  ecaudit::test::MemorySource source(packets);
  capture::CapturedFrame frame;
  ASSERT_EQ(source.Next(frame), capture::ReadStatus::kFrame);
  const wire::FrameView sent = wire::FrameView::Parse(frame);
  const std::uint64_t key = sent.key();
  const Progress before = ProgressOf(sent);
  const Bytes copy = packets[0].bytes;
  ASSERT_EQ(source.Next(frame), capture::ReadStatus::kFrame);
  const wire::FrameView returned = wire::FrameView::Parse(frame);
  EXPECT_EQ(returned.key(), key);
  EXPECT_TRUE(Further(ProgressOf(returned), before));
  EXPECT_FALSE(Further(before, ProgressOf(returned)));
  EXPECT_FALSE(Further(before, before));

  // Any other field makes another frame: command, index, address, register, length of the second datagram.
  const std::size_t second = 16 + 14;
  for (const std::size_t offset :
       {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{4}, std::size_t{5}}) {
    Bytes changed = copy;
    changed[second + offset] = static_cast<std::uint8_t>(changed[second + offset] ^ 1U);
    capture::CapturedFrame other;
    other.number = 1;
    other.bytes = changed;
    other.original_length = static_cast<std::uint32_t>(changed.size());
    EXPECT_NE(wire::FrameView::Parse(other).key(), key) << offset;
  }
}

TEST(Direction, ProgressAcrossTheEndOfThePositionCounter) {
  EXPECT_TRUE(Further({.positions = 2, .counted = 1}, {.positions = 0xFFFF, .counted = 0}));
  EXPECT_FALSE(Further({.positions = 0xFFFF, .counted = 1}, {.positions = 2, .counted = 0}));
  EXPECT_TRUE(Further({.positions = 5, .counted = 1}, {.positions = 5, .counted = 0}));
}

/// A master that finds nobody: every frame `times` times under its index, 2 ms apart.
std::string InVain(int frames, int times) {
  std::string lines;
  for (int i = 0; i < frames; ++i) {
    for (int k = 0; k < times; ++k) lines += "+2ms BRD 0x0000 00 idx=" + std::to_string(i % 16) + " @lost\n";
  }
  return lines;
}

TEST(NoAnswers, FramesRepeatedUnderOneIndex) {
  for (const bool bit : {false, true}) {
    const Paired result = PairUp((bit ? "@mac 02:10:10:10:10:10\n" : "") + InVain(10, 5));
    EXPECT_TRUE(result.statistics.no_answers) << bit;
    EXPECT_FALSE(result.outbound_only) << "the returns are not missing: there are none";
    EXPECT_EQ(result.statistics.outbound, 50U) << bit;
    EXPECT_EQ(result.statistics.repeated_unanswered, 40U) << bit;
    EXPECT_EQ(result.statistics.lost, 0U) << "nothing overtook them";
    EXPECT_TRUE(result.statistics.frames().Balances());
    EXPECT_THAT(result.log.Only("1?"), IsEmpty()) << "nothing is taken as done";
  }
}

TEST(NoAnswers, NotWhereOnlyOutboundFramesAreCaptured) {
  std::string running;
  std::string polls;
  std::string process;
  for (int i = 0; i < 60; ++i) {
    running += "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i % 16) + " @lost\n";
    polls += "+1ms FPRD 0x1001:0x0130 08 00 idx=255 @lost\n";
    process += "+1ms LRW 0x1000 01 02 idx=" + std::to_string(i / 4) + " @lost\n";
  }
  for (const std::string& lines : {running, polls, process}) {
    const Paired result = PairUp(lines);
    EXPECT_FALSE(result.statistics.no_answers);
    EXPECT_TRUE(result.outbound_only);
    EXPECT_EQ(result.statistics.frames().undecided_total(), 60U);
  }
}

TEST(NoAnswers, NotWhereASlaveAnswersLater) {
  for (const char* mac : {"", "@mac 02:10:10:10:10:10\n"}) {
    const Paired result = PairUp(mac + InVain(60, 5) + "+1ms FPRD 0x1001:0x0130 08 00 idx=3\n");
    EXPECT_FALSE(result.statistics.no_answers) << mac;
    EXPECT_EQ(result.statistics.paired, 1U) << mac;
    EXPECT_TRUE(result.statistics.frames().Balances());
  }
}

}  // namespace
}  // namespace ecaudit::bus::test
