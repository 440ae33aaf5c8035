// SOEM with cable redundancy (esc-reference 3.4): the primary port sends the real frame from 01:01:.., the secondary
// port a BRD with the same index from 04:04:.. . In an intact ring each arrives at the other port.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/bus/ring_join.h"
#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

using ::testing::IsEmpty;

constexpr samples::MacAddress kPrimary{0x01, 0x01, 0x01, 0x01, 0x01, 0x01};
constexpr samples::MacAddress kSecondary{0x04, 0x04, 0x04, 0x04, 0x04, 0x04};

/// One cycle in an intact ring of three slaves as both ports see it: packet 4i+1 real frame out (interface 0), 4i+2
/// dummy out (1), 4i+3 real frame in (1), 4i+4 dummy in (0).
std::vector<Packet> IntactRing(int cycles) {
  Trace trace;
  trace.Slaves(3);
  for (int i = 0; i < cycles; ++i) {
    const auto index = static_cast<std::uint8_t>(i % 16);
    trace.Mac(kPrimary);
    trace.After(1000).Lrw(0x1000, Bytes(30, 0), Bytes(30, 1)).Index(index);
    trace.Mac(kSecondary);
    trace.After(1).Brd(0x0000, {0x11, 0}).Index(index);
  }
  std::vector<Packet> packets = trace.Packets();
  for (Packet& packet : packets) {
    const bool primary = (packet.bytes[6] & ~2U) == 0x01;
    const bool returned = (packet.bytes[6] & 2U) != 0;
    packet.interface_index = primary == returned ? 1 : 0;
  }
  return packets;
}

std::vector<Packet> OnlyInterface(const std::vector<Packet>& packets, std::uint16_t interface_index) {
  std::vector<Packet> out;
  for (const Packet& packet : packets) {
    if (packet.interface_index == interface_index) out.push_back(packet);
  }
  return out;
}

TEST(Redundancy, IntactRingBothPortsCaptured) {
  const Paired result = PairUp(IntactRing(300));
  EXPECT_EQ(result.statistics.paired, 600U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.foreign, 0U);
}

/// What the secondary port sends meets the slaves on their way back, where nothing is done to it, or to its address.
TEST(Redundancy, WhatTheOtherEndSentArrivesAsItWasSent) {
  for (const bool one_interface : {false, true}) {
    std::vector<Packet> packets = IntactRing(300);
    std::vector<std::uint8_t> sent;
    for (Packet& packet : packets) {
      const bool secondary = (packet.bytes[6] & ~2U) == 0x04;
      const bool returned = (packet.bytes[6] & 2U) != 0;
      if (secondary && !returned) sent = packet.bytes;
      if (secondary && returned) packet.bytes = sent;
      if (one_interface) packet.interface_index = 0;
    }
    const Paired result = PairUp(packets);
    EXPECT_EQ(result.statistics.paired, 600U);
    EXPECT_EQ(result.statistics.other_end, 300U);
    EXPECT_EQ(result.statistics.lost, 0U);
    EXPECT_EQ(result.statistics.foreign, 0U);
  }
}

TEST(Redundancy, IntactRingOnlyThePrimaryPortCaptured) {
  // Outbound process frames never come back here; dummies nobody sent here do.
  const Paired result = PairUp(OnlyInterface(IntactRing(600), 0));
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_THAT(result.log.Only("silent"), IsEmpty());
  EXPECT_EQ(result.statistics.outbound, 600U);
  EXPECT_EQ(result.statistics.returned, 600U);
  EXPECT_EQ(result.statistics.unmatched_returned, 600U);
  EXPECT_EQ(result.statistics.duplicated, 0U);
}

TEST(Redundancy, IntactRingOnlyTheSecondaryPortCaptured) {
  const Paired result = PairUp(OnlyInterface(IntactRing(600), 1));
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.duplicated, 0U);
  EXPECT_EQ(result.statistics.unmatched_returned, 600U);
}

/// What the captured port of a line sends and gets: the main end's frames go out, and what the other end sent arrives
/// as it was sent; from `broken` to `closed` the main end's frames come back instead.
std::vector<Packet> MainPort(int frames, int broken, int closed, bool dummies) {
  Trace trace;
  trace.Slaves(3);
  for (int i = 0; i < frames; ++i) {
    const auto index = static_cast<std::uint8_t>(i % 16);
    const auto station = static_cast<std::uint16_t>(0x1001 + i % 3);
    trace.Mac(kPrimary);
    auto& main = trace.After(1000).Fprd(station, 0x0130, {8, 0}).Index(index);
    if (i >= broken && i < closed) continue;
    main.Lost();
    trace.Mac(kSecondary);
    auto& other = trace.After(60);
    (dummies ? other.Brd(0, {0, 0}) : other.Fprd(station, 0x0130, {0, 0})).Index(index).Lost();
  }
  return trace.Packets();
}

TEST(Redundancy, AtTheMainPortAloneWhatTheOtherEndSentShowsThatTheLineIsWhole) {
  for (const bool dummies : {false, true}) {
    const Paired result = PairUp(MainPort(600, 600, 600, dummies));
    EXPECT_TRUE(result.statistics.one_port) << dummies;
    EXPECT_EQ(result.statistics.other_end, 600U) << dummies;
    EXPECT_EQ(result.statistics.outbound, 600U) << dummies;
    EXPECT_EQ(result.statistics.frames().undecided_total(), 600U) << dummies;
    EXPECT_EQ(result.log.words.size(), 600U) << "each frame is taken as done, once";
    EXPECT_EQ(result.log.words.front(), "1?") << dummies;
  }
}

TEST(Redundancy, AtTheMainPortAloneABrokenLineBringsFramesBackAndAWholeOneLosesNone) {
  for (const bool dummies : {false, true}) {
    const Paired result = PairUp(MainPort(900, 300, 600, dummies));
    EXPECT_EQ(result.statistics.paired, 300U) << dummies;
    EXPECT_EQ(result.statistics.lost, 0U) << dummies;
    EXPECT_EQ(result.statistics.missed_outbound, 0U) << dummies;
    EXPECT_EQ(result.statistics.altered, 0U) << dummies;
    EXPECT_EQ(result.statistics.other_end, 600U) << dummies;
    EXPECT_TRUE(result.statistics.frames().Balances());
  }
}

TEST(Redundancy, AtTheOtherPortAloneWhatItSendsIsNotDoneTwice) {
  Trace trace;
  trace.Slaves(3);
  for (int i = 0; i < 100; ++i) {
    const auto index = static_cast<std::uint8_t>(i % 16);
    trace.Mac(kSecondary).After(1000).Fpwr(0x1001, 0x1000, {1, 2}).Index(index).Lost();
    trace.Mac(kPrimary).After(25).Fpwr(0x1001, 0x1000, {1, 2}).Index(index).ReturnedOnly();
  }
  const Paired result = PairUp(trace);
  EXPECT_FALSE(result.statistics.one_port);
  EXPECT_THAT(result.log.words, ::testing::Each(::testing::StartsWith("+")));
  EXPECT_EQ(result.log.words.size(), 100U);
}

TEST(Redundancy, TwoMastersWhoseReturnsAreNotCapturedAreNoLine) {
  Trace trace;
  trace.Slaves(3);
  for (int i = 0; i < 100; ++i) {
    trace.Mac(kPrimary).After(1000).Lrw(0x1000, {1, 2}, {3, 4}).Lost();
    trace.Mac(kSecondary).After(60).Fprd(0x1001, 0x0130, {0, 0}).Lost();
  }
  const Paired result = PairUp(trace);
  EXPECT_FALSE(result.statistics.one_port);
  EXPECT_EQ(result.log.words.size(), 200U);
}

TEST(Redundancy, BrokenRingTheReturnedFrameGoesOutAgain) {
  // Broken behind the first of three slaves: the process frame returns on the primary port with a part of the counter,
  // goes out on the secondary port as it is, and returns there complete.
  for (const bool mac_bit_kept : {false, true}) {
    Trace trace;
    for (int i = 0; i < 400; ++i) {
      const auto index = static_cast<std::uint8_t>(i % 16);
      trace.Mac(kPrimary).Slaves(1);
      trace.After(1000).Lrw(0x1000, Bytes(30, 0), Bytes(30, 1)).Index(index).Wkc(3);
      trace.Mac(kSecondary).Slaves(2);
      trace.After(1).Brd(0x0000, {0x11, 0}).Index(index);
      trace.Mac(mac_bit_kept ? samples::AfterSlave(kPrimary) : kPrimary);
      ecaudit::test::TraceDatagram again;
      again.command = samples::Cmd::LRW;
      again.ado = 0;
      again.adp = 0x1000;
      again.sent = again.returned = Bytes(30, 1);
      again.sent_wkc = 3;
      again.wkc = 9;
      again.index = index;
      trace.After(100).Add(again);
    }
    std::vector<Packet> packets = trace.Packets();
    int place = 0;  // process frame out, dummy out, process frame back, dummy back, process frame out again and back
    for (Packet& packet : packets) {
      packet.interface_index = place % 6 == 0 || place % 6 == 2 ? 0 : 1;
      ++place;
    }
    const Paired result = PairUp(packets);
    EXPECT_EQ(result.statistics.lost, 0U) << mac_bit_kept;
    EXPECT_EQ(result.statistics.duplicated, 0U) << mac_bit_kept;
    EXPECT_EQ(result.log.Only("altered").size(), 0U) << mac_bit_kept;
    EXPECT_EQ(result.statistics.frames().undecided_total(), 0U) << mac_bit_kept;
  }
}

/// One request of the master at both ends. At the second one nobody takes part; some slaves set the MAC bit all the
/// same.
void AddAtBothEnds(Trace& trace, int i, bool same_index) {
  const auto index = static_cast<std::uint8_t>(i);
  trace.Mac(kPrimary).Slaves(3);
  trace.After(1000).Fpwr(static_cast<std::uint16_t>(0x1001 + i % 3), 0x0120, {8, 0}).Index(index);
  trace.Mac(kSecondary);
  trace.After(1)
      .Fpwr(static_cast<std::uint16_t>(0x1001 + i % 3), 0x0120, {8, 0})
      .Wkc(0)
      .Index(static_cast<std::uint8_t>(same_index ? index : index + 100));
}

TEST(Redundancy, WhatNoSlaveAcceptsAtTheOtherEndIsNoAnswer) {
  for (const bool bit_set : {true, false}) {
    Trace trace;
    for (int i = 0; i < 100; ++i) AddAtBothEnds(trace, i, bit_set);
    std::vector<Packet> packets = trace.Packets();
    for (Packet& packet : packets) {
      if ((packet.bytes[6] & ~2U) == 0x04 && !bit_set) packet.bytes[6] = 0x04;
    }
    const Paired result = PairUp(packets);
    EXPECT_EQ(result.statistics.paired, 200U) << bit_set;
    EXPECT_EQ(result.statistics.other_end, 100U) << bit_set;
    EXPECT_EQ(result.log.words.size(), 100U) << bit_set;
    EXPECT_EQ(result.log.sent.size(), 100U) << bit_set;
  }
}

TEST(Redundancy, EqualProgramsOnTwoSegmentsAreNoRing) {
  // The same frames, in step; the slaves named answer both.
  Trace trace;
  for (int i = 0; i < 100; ++i) {
    for (const samples::MacAddress& mac : {kPrimary, kSecondary}) {
      trace.Mac(mac).Slaves(3);
      trace.After(100).Fprd(static_cast<std::uint16_t>(0x1001 + i % 3), 0x0130, {8, 0});
    }
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.foreign, 200U);
  EXPECT_EQ(result.statistics.paired, 100U);
  EXPECT_EQ(result.statistics.other_end, 0U);
}

TEST(Redundancy, WhoExchangesProcessDataBesideTheMasterHasAnotherSegment) {
  Trace trace;
  for (int i = 0; i < 60; ++i) {
    trace.Mac(kPrimary).Slaves(3);
    trace.After(400).Lrw(0, Bytes(6, 0), Bytes(6, 1));
    trace.After(200).Brd(0x0130, {8, 0});
    trace.Mac(kSecondary);
    trace.After(400).Lrw(0, Bytes(9, 0), Bytes(9, 1));
    if (i % 7 == 0) trace.After(10).Brd(0x0130, {8, 0});
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.foreign, 2U * (60U + 9U));
  EXPECT_EQ(result.statistics.paired, 120U);
}

TEST(Redundancy, PollsThatAreThoseOfTheMasterAreASecondMaster) {
  Trace trace;
  for (int i = 0; i < 100; ++i) {
    trace.Mac(kPrimary).Slaves(3);
    trace.After(400).Lrw(0, Bytes(6, 0), Bytes(6, 1));
    trace.After(200).Brd(0x0130, {8, 0});
    trace.Mac(kSecondary);
    trace.After(400).Brd(0x0130, {8, 0});
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.foreign, 0U);
  EXPECT_EQ(result.statistics.paired, 300U);
}

/// Hears transactions only.
class Transactions : public BusSink {
 public:
  void OnFrame(const wire::FrameView&, Direction) override {}
  void OnSent(const wire::FrameView&) override {}
  void OnDoubtful(const wire::FrameView&) override {}
  void OnLost(const wire::FrameView&, Loss, bool) override {}
  void OnDuplicate(const wire::FrameView&, FrameNo) override {}
  void OnRepeated(const RepeatedFrame&) override {}
  void OnUnusable(const wire::FrameView&, Unusable, bool) override {}
};

/// Both halves of what a master asks for, while the line is broken.
class RingJoined final : public Transactions {
 public:
  void OnTransaction(const BusTransaction& t) override {
    wkc.push_back((*t.returned)[0].wkc());
    const ByteSpan bytes = (*t.returned)[0].data();
    data.emplace_back(bytes.begin(), bytes.end());
  }
  std::vector<std::uint16_t> wkc;
  std::vector<std::vector<std::uint8_t>> data;
};

TEST(Redundancy, TheHalvesOfABrokenLineAreJoined) {
  Trace trace;
  for (int i = 0; i < 20; ++i) {
    trace.Mac(kPrimary).After(1000).Lrw(0, {1, 2, 0, 0}, {1, 2, 7, 0}).Wkc(3);
    trace.Mac(kSecondary).After(1).Lrw(0, {1, 2, 0, 0}, {1, 2, 0, 8}).Wkc(3);
    trace.Mac(kPrimary).After(1000).Fprd(0x1002, 0x0130, {0, 0}).Wkc(0);
    trace.Mac(kSecondary).After(1).Fprd(0x1002, 0x0130, {8, 0}).Wkc(1);
  }
  const std::vector<Packet> packets = trace.Packets();
  RingJoined log;
  RingJoin join(log);
  DirectionLearner directions;
  ecaudit::test::MemorySource first(packets);
  capture::CapturedFrame frame;
  while (first.Next(frame) == capture::ReadStatus::kFrame) directions.Learn(wire::FrameView::Parse(frame));
  directions.Finish();
  class Forward final : public Transactions {
   public:
    explicit Forward(RingJoin& to) : to_(to) {}
    void OnTransaction(const BusTransaction& t) override { to_.Push(t); }

   private:
    RingJoin& to_;
  } forward(join);
  Pairing pairing(directions, forward);
  ecaudit::test::MemorySource again(packets);
  while (again.Next(frame) == capture::ReadStatus::kFrame) pairing.Push(wire::FrameView::Parse(frame));
  pairing.Finish();
  join.Flush();
  // That the line is broken shows with the second frame.
  ASSERT_EQ(log.wkc.size(), 41U);
  for (std::size_t i = 3; i < log.wkc.size(); i += 2) {
    EXPECT_EQ(log.wkc[i], 6U) << i;
    EXPECT_EQ(log.data[i], (std::vector<std::uint8_t>{1, 2, 7, 8})) << i;
    EXPECT_EQ(log.wkc[i - 1], 1U) << i;
    EXPECT_EQ(log.data[i - 1], (std::vector<std::uint8_t>{8, 0})) << i;
  }
}

/// The snap length has taken datagrams of one half: they are no halves of one answer.
TEST(Redundancy, AHalfThatWasCutIsNotJoined) {
  Trace trace;
  for (int i = 0; i < 2; ++i) {
    trace.Mac(kSecondary).After(1000).Lrw(0, {1, 2, 0, 0}, {1, 2, 0, 8}).Wkc(3);
    trace.Mac(kPrimary).After(1).Lrw(0, {1, 2, 0, 0}, {1, 2, 7, 0}).Wkc(3);
  }
  std::vector<Packet> packets = trace.Packets();
  ASSERT_EQ(packets.size(), 8U);
  constexpr std::size_t kInFirstDatagram = 30;
  packets[5].original_length = static_cast<std::uint32_t>(packets[5].bytes.size());
  packets[5].bytes.resize(kInFirstDatagram);
  std::vector<wire::FrameView> views;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const capture::CapturedFrame frame = ecaudit::test::AsCaptured(packets[i], i + 1);
    views.push_back(wire::FrameView::Parse(frame));
  }
  ASSERT_EQ(views[5].kind(), wire::FrameKind::kCut);
  ASSERT_TRUE(views[5].empty());
  struct Counted final : Transactions {
    void OnTransaction(const BusTransaction& t) override {
      returned.push_back(t.joined && t.returned->ref().number == 4);
    }
    std::vector<bool> returned;
  } log;
  RingJoin join(log);
  for (std::size_t i = 0; i < views.size(); i += 2) {
    join.Push({&views[i], &views[i + 1], false, GapBefore::kNone, i % 4 == 0});
  }
  join.Flush();
  EXPECT_EQ(log.returned, (std::vector<bool>{true, false, false})) << "one answer of two halves, and two alone";
}

}  // namespace
}  // namespace ecaudit::bus::test
