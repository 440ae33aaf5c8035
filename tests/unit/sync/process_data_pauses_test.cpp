// Pauses of all outputs, datagram by datagram.
#include "analyzers/sync/process_data_pauses.h"

#include <gtest/gtest.h>

namespace ecaudit::sync {
namespace {

constexpr TimeNs kMilli = 1'000'000;

class ProcessDataPausesTest : public ::testing::Test {
 protected:
  /// One frame that returns `later` after the one before, with outputs in each of its datagrams.
  FrameRef Frame(TimeNs later, int datagrams = 1, std::uint16_t wkc = 3) {
    time_ += later;
    const FrameRef frame{++number_, time_, true};
    for (int i = 0; i < datagrams; ++i) {
      track::LogicalAccess access;
      access.returned = frame;
      access.wkc = wkc;
      pauses_.On(access);
    }
    return frame;
  }
  void Run(int frames, int datagrams = 1) {
    for (int i = 0; i < frames; ++i) Frame(kMilli, datagrams);
  }
  FrameRef Now(TimeNs later) { return {++number_, time_ += later, true}; }

  ProcessDataPauses pauses_;
  FrameNo number_ = 0;
  TimeNs time_ = 0;
};

TEST_F(ProcessDataPausesTest, APauseLiesBetweenTwoFrames) {
  for (const int datagrams : {1, 3}) {
    pauses_ = {};
    Run(20, datagrams);
    const FrameNo last = number_;
    const FrameRef again = Frame(140 * kMilli, datagrams);
    const auto pause = pauses_.LongestBetween(last, Now(kMilli));
    ASSERT_TRUE(pause) << datagrams << " datagrams in a frame";
    EXPECT_EQ(pause->from.number, last);
    EXPECT_EQ(pause->to, again);
    EXPECT_EQ(pause->length(), 140 * kMilli);
  }
}

TEST_F(ProcessDataPausesTest, OutputsThatNoSlaveTakesAreNone) {
  Run(20);
  const FrameNo last = number_;
  for (int i = 0; i < 140; ++i) Frame(kMilli, 1, 0);
  const auto pause = pauses_.LongestBetween(last, Now(0));
  ASSERT_TRUE(pause) << "it has not ended";
  EXPECT_EQ(pause->from.number, last);
  EXPECT_EQ(pause->length(), 140 * kMilli);
}

TEST_F(ProcessDataPausesTest, ASlowRhythmIsNoPause) {
  for (int i = 0; i < 20; ++i) Frame(30 * kMilli);
  EXPECT_FALSE(pauses_.LongestBetween(0, Now(30 * kMilli)));
}

TEST_F(ProcessDataPausesTest, WhatWasOverLongBeforeDoesNotCount) {
  Run(20);
  Frame(140 * kMilli);
  Run(30);
  const FrameNo good = number_;
  EXPECT_FALSE(pauses_.LongestBetween(good, Now(kMilli)));
  EXPECT_TRUE(pauses_.LongestBetween(0, Now(kMilli))) << "nothing shows the slave since";
}

}  // namespace
}  // namespace ecaudit::sync
