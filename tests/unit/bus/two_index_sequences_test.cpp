#include "decoder/bus/two_index_sequences.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/trace_builder.h"

namespace ecaudit::bus::test {
namespace {

/// The sequences of the frames of a trace. Every packet of it is sent by, or comes back to, one network card.
TwoIndexSequences SequencesOf(const std::string& lines) {
  const Result<ecaudit::test::Trace> trace = ecaudit::test::Trace::Parse(lines);
  EXPECT_TRUE(trace.has_value());
  const std::vector<ecaudit::test::Packet> packets = trace ? trace->Packets() : std::vector<ecaudit::test::Packet>();
  ecaudit::test::MemorySource source(packets);
  TwoIndexSequences sequences;
  capture::CapturedFrame packet;
  bool returned = false;
  while (source.Next(packet) == capture::ReadStatus::kFrame) {
    const wire::FrameView frame = wire::FrameView::Parse(packet);
    if (returned) {
      sequences.FollowReturned(frame);
    } else {
      sequences.FollowSent(frame);
    }
    returned = !returned;
  }
  return sequences;
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

TEST(TwoIndexSequences, OneSequenceHasNoTurns) {
  const TwoIndexSequences sequences = SequencesOf("@slaves 1\n" + Polls(40, 0));
  EXPECT_EQ(sequences.turns(), 0U);
  EXPECT_FALSE(sequences.Collide());
}

TEST(TwoIndexSequences, ARestartIsNoTurn) {
  const TwoIndexSequences sequences = SequencesOf("@slaves 1\n" + Polls(20, 40) + Polls(20, 0));
  EXPECT_EQ(sequences.turns(), 0U);
}

TEST(TwoIndexSequences, ACounterThatRestartsAtItsLowestStaysOneSequence) {
  const TwoIndexSequences sequences = SequencesOf("@slaves 1\n" + Polls(16, 0) + Polls(16, 0) + Polls(16, 0));
  EXPECT_EQ(sequences.current().frames, 48U);
  EXPECT_EQ(sequences.turns(), 0U);
}

TEST(TwoIndexSequences, SequencesInTurnThatAreBothAnsweredDoNotCollide) {
  const TwoIndexSequences sequences =
      SequencesOf("@slaves 1\n" + Polls(8, 0) + Scan(8, 100) + Polls(8, 8) + Scan(8, 108) + Polls(8, 16));
  EXPECT_EQ(sequences.turns(), 3U);
  EXPECT_EQ(sequences.later().began.number, 17U);
  EXPECT_FALSE(sequences.Collide());
  EXPECT_FALSE(sequences.SetUpTwice());
}

constexpr const char* kSetUp = "+1ms APWR 0:0x0010 01 10 idx=0\n";
constexpr const char* kClear = "+1ms BWR 0x0010 00 00 idx=100\n";

TEST(TwoIndexSequences, TheOneWhoseStationAddressesAreClearedCollides) {
  const TwoIndexSequences sequences =
      SequencesOf("@slaves 1\n" + (kSetUp + Polls(8, 1)) + kClear + Scan(8, 101) + Polls(8, 9, 0) + Scan(8, 109));
  EXPECT_TRUE(sequences.Collide());
  EXPECT_EQ(sequences.unanswered(), 8U);
}

TEST(TwoIndexSequences, ASlaveThatIsPulledIsNotTheWorkOfTheOther) {
  EXPECT_FALSE(
      SequencesOf("@slaves 1\n" + (kSetUp + Polls(8, 1)) + Scan(8, 100) + Polls(20, 9, 0) + Scan(8, 108)).Collide());
}

TEST(TwoIndexSequences, WhoNeverGaveStationAddressesDoesNotLoseThem) {
  EXPECT_FALSE(
      SequencesOf("@slaves 1\n" + Polls(8, 1) + kClear + Scan(8, 101) + Polls(20, 9, 0) + Scan(8, 109)).Collide());
}

TEST(TwoIndexSequences, WhatWasNotAnsweredBeforeTheOtherBeganIsNotItsWork) {
  EXPECT_FALSE(SequencesOf("@slaves 1\n" + (kSetUp + Polls(8, 1)) + Polls(20, 9, 0) + kClear + Scan(8, 101) +
                           Polls(4, 29) + Scan(4, 109))
                   .Collide());
}

TEST(TwoIndexSequences, BothThatGiveAnAddressToOneSlaveSetItUpTwice) {
  const std::string first = "+1ms APWR 0:0x0010 01 10 idx=8\n";
  const std::string second = "+1ms APWR 0:0x0010 02 10 idx=108\n";
  EXPECT_TRUE(SequencesOf("@slaves 1\n" + Polls(8, 0) + first + Scan(8, 100) + second).SetUpTwice());
  const std::string other = "+1ms APWR 1:0x0010 02 10 idx=108\n";
  EXPECT_FALSE(SequencesOf("@slaves 2\n" + Polls(8, 0) + first + Scan(8, 100) + other).SetUpTwice());
}

}  // namespace
}  // namespace ecaudit::bus::test
