#include "decoder/bus/two_counters.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/trace_builder.h"

namespace ecaudit::bus::test {
namespace {

/// The rows of the frames of a trace. Every packet of it is sent by, or comes back to, one network card.
TwoCounters CountersOf(const std::string& lines) {
  const Result<ecaudit::test::Trace> trace = ecaudit::test::Trace::Parse(lines);
  EXPECT_TRUE(trace.has_value());
  const std::vector<ecaudit::test::Packet> packets = trace ? trace->Packets() : std::vector<ecaudit::test::Packet>();
  ecaudit::test::MemorySource source(packets);
  TwoCounters counters;
  capture::CapturedFrame packet;
  bool returned = false;
  while (source.Next(packet) == capture::ReadStatus::kFrame) {
    const wire::FrameView frame = wire::FrameView::Parse(packet);
    if (returned) {
      counters.FollowReturned(frame);
    } else {
      counters.FollowSent(frame);
    }
    returned = !returned;
  }
  return counters;
}

/// `count` polls numbered from `index` on. @param wkc of the answers
std::string Polls(int count, int index, int wkc = 1) {
  std::string lines;
  for (int i = 0; i < count; ++i) {
    lines += "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(index + i) + " wkc=" + std::to_string(wkc) + "\n";
  }
  return lines;
}

/// The second program reads the positions of the bus.
std::string Scan(int count, int index) {
  std::string lines;
  for (int i = 0; i < count; ++i) lines += "+1ms APRD 0:0x0130 01 00 idx=" + std::to_string(index + i) + "\n";
  return lines;
}

TEST(TwoCounters, OneRowHasNoTurns) {
  const TwoCounters counters = CountersOf("@slaves 1\n" + Polls(40, 0));
  EXPECT_EQ(counters.turns(), 0U);
  EXPECT_FALSE(counters.Collide());
}

TEST(TwoCounters, ARestartIsNoTurn) {
  const TwoCounters counters = CountersOf("@slaves 1\n" + Polls(20, 40) + Polls(20, 0));
  EXPECT_EQ(counters.turns(), 0U);
}

TEST(TwoCounters, ACounterThatRestartsAtItsLowestStaysOneRow) {
  const TwoCounters counters = CountersOf("@slaves 1\n" + Polls(16, 0) + Polls(16, 0) + Polls(16, 0));
  EXPECT_EQ(counters.current().frames, 48U);
  EXPECT_EQ(counters.turns(), 0U);
}

TEST(TwoCounters, RowsInTurnThatAreBothAnsweredDoNotCollide) {
  const TwoCounters counters =
      CountersOf("@slaves 1\n" + Polls(8, 0) + Scan(8, 100) + Polls(8, 8) + Scan(8, 108) + Polls(8, 16));
  EXPECT_EQ(counters.turns(), 3U);
  EXPECT_EQ(counters.later().began.number, 17U);
  EXPECT_FALSE(counters.Collide());
  EXPECT_FALSE(counters.SetUpTwice());
}

TEST(TwoCounters, ARowThatLosesItsSlavesCollides) {
  const TwoCounters counters = CountersOf("@slaves 1\n" + Polls(8, 0) + Scan(8, 100) + Polls(8, 8, 0) + Scan(8, 108));
  EXPECT_TRUE(counters.Collide());
}

TEST(TwoCounters, WhatWasNotAnsweredBeforeTheSecondRowBeganIsNotItsWork) {
  const TwoCounters counters =
      CountersOf("@slaves 1\n" + Polls(8, 0) + Polls(20, 8, 0) + Scan(8, 100) + Polls(4, 28) + Scan(4, 108));
  EXPECT_FALSE(counters.Collide());
}

TEST(TwoCounters, RowsThatGiveAnAddressToOneSlaveSetItUpTwice) {
  const std::string first = "+1ms APWR 0:0x0010 01 10 idx=8\n";
  const std::string second = "+1ms APWR 0:0x0010 02 10 idx=108\n";
  EXPECT_TRUE(CountersOf("@slaves 1\n" + Polls(8, 0) + first + Scan(8, 100) + second).SetUpTwice());
  const std::string other = "+1ms APWR 1:0x0010 02 10 idx=108\n";
  EXPECT_FALSE(CountersOf("@slaves 2\n" + Polls(8, 0) + first + Scan(8, 100) + other).SetUpTwice());
}

}  // namespace
}  // namespace ecaudit::bus::test
