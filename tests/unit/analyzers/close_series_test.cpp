#include "analyzers/collect/close_series.h"

#include <gtest/gtest.h>

namespace ecaudit::timeline {
namespace {

FrameRef CloseFrame(FrameNo number) {
  return {number, static_cast<TimeNs>(number) * 1000, true};
}

/// Values of the frames [from, to], each its own number.
void AddFrames(CloseSeries& series, FrameNo from, FrameNo to) {
  for (FrameNo number = from; number <= to; ++number) series.Add(CloseFrame(number), static_cast<double>(number));
}

TEST(CloseSeries, KeepsNothingUnasked) {
  CloseSeries series;
  EXPECT_EQ(series.Keep(5), 0U);
  AddFrames(series, 1, 1000);
  EXPECT_TRUE(series.kept().empty());
}

TEST(CloseSeries, KeepsBeforeAndBehind) {
  CloseSeries series;
  AddFrames(series, 1, 100);
  EXPECT_EQ(series.Keep(95), 2 * CloseSeries::kAround + 1);
  AddFrames(series, 101, 200);
  ASSERT_EQ(series.kept().size(), 2 * CloseSeries::kAround + 1);
  EXPECT_EQ(series.kept().front().frame, 75U);
  EXPECT_EQ(series.kept().back().frame, 115U);
  EXPECT_EQ(series.kept().back().value, 115);
  EXPECT_EQ(series.kept().back().time, 115'000);
}

TEST(CloseSeries, WhatOverlapsIsKeptOnce) {
  CloseSeries series;
  AddFrames(series, 1, 100);
  series.Keep(90);
  EXPECT_EQ(series.Keep(100), 10U);
  EXPECT_EQ(series.Keep(80), 10U) << "an earlier one that is told of later";
  AddFrames(series, 101, 200);
  ASSERT_EQ(series.kept().size(), 61U);
  for (std::size_t i = 0; i < series.kept().size(); ++i) EXPECT_EQ(series.kept()[i].frame, 60 + i);
}

TEST(CloseSeries, BetweenTwoFrames) {
  CloseSeries series;
  for (FrameNo number = 10; number <= 500; number += 10) series.Add(CloseFrame(number), 1);
  series.Keep(255);
  ASSERT_EQ(series.kept().size(), 41U);
  EXPECT_EQ(series.kept()[CloseSeries::kAround].frame, 260U);
}

TEST(CloseSeries, WhatIsForgottenIsNotKept) {
  CloseSeries series;
  AddFrames(series, 1, 2000);
  EXPECT_EQ(series.Keep(2000 - CloseSeries::kRemembered), 0U);
  EXPECT_GT(series.Keep(2000 - CloseSeries::kRemembered + 1), 0U);
  EXPECT_EQ(series.kept().front().frame, 2000 - CloseSeries::kRemembered + 1);
}

TEST(CloseSeries, WhatMayBeAskedForIsHeld) {
  CloseSeries series;
  AddFrames(series, 1, 100);
  series.Remember(100);
  AddFrames(series, 101, 2000);
  EXPECT_TRUE(series.kept().empty());
  EXPECT_EQ(series.Keep(99), 0U) << "forgotten";
  EXPECT_EQ(series.Keep(100), 2 * CloseSeries::kAround + 1);
  EXPECT_EQ(series.kept().front().frame, 81U);
  EXPECT_EQ(series.kept().back().frame, 121U);
}

}  // namespace
}  // namespace ecaudit::timeline
