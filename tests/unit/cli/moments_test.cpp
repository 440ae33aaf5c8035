#include "cli/moments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::cli {
namespace {

TEST(Moments, Seconds) {
  const Result<Moment> moment = ParseMoment("--from", "1.25", false);
  ASSERT_TRUE(moment);
  EXPECT_EQ(moment->kind, Moment::Kind::kSeconds);
  EXPECT_DOUBLE_EQ(moment->seconds, 1.25);
}

TEST(Moments, Frames) {
  const Result<Moment> moment = ParseMoment("--from", "#760", false);
  ASSERT_TRUE(moment);
  EXPECT_EQ(moment->kind, Moment::Kind::kFrame);
  EXPECT_EQ(moment->frame, 760U);
}

TEST(Moments, ClockTimes) {
  const Result<Moment> clock = ParseMoment("--from", "02:13:07.250", false);
  ASSERT_TRUE(clock);
  EXPECT_EQ(clock->kind, Moment::Kind::kClock);
  EXPECT_EQ(clock->ns, TimeNs{7'987'250} * 1'000'000);
  EXPECT_EQ(ParseMoment("--from", "02:13", false)->ns, TimeNs{7'980} * 1'000'000'000);
  const Result<Moment> time = ParseMoment("--from", "2019-05-01T12:00:00Z", true);
  ASSERT_TRUE(time);
  EXPECT_EQ(time->kind, Moment::Kind::kTime);
  EXPECT_EQ(time->ns, 1'556'712'000'000'000'000);
}

TEST(Moments, Nonsense) {
  for (const char* text : {"", "-1", "1s", "#", "#0", "#-1", "#1x", "inf", "nan", "24:00", "02:60", "2:13",
                           "02:13:", "2019-02-30", "02:13:07.25x"}) {
    const Result<Moment> moment = ParseMoment("--to", text, false);
    ASSERT_FALSE(moment) << text;
    EXPECT_THAT(moment.error().message, testing::StartsWith("--to is '" + std::string(text) + "' but must be"));
  }
}

TEST(Moments, WhatNeedsNoCaptureIsPlacedAtOnce) {
  MomentRange range;
  range.around = Moment{};
  range.around->seconds = 0.5;
  range.window_s = 2;
  AnalysisOptions analysis;
  ASSERT_FALSE(range.needs_capture());
  EXPECT_FALSE(PlaceMoments(range, {}, analysis));
  EXPECT_EQ(analysis.from_s, 0.0);
  EXPECT_EQ(analysis.to_s, 2.5);
  range.around->kind = Moment::Kind::kFrame;
  EXPECT_TRUE(range.needs_capture());
}

}  // namespace
}  // namespace ecaudit::cli
