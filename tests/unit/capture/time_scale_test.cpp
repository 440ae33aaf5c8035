#include "decoder/capture/time_scale.h"

#include <limits>

#include <gtest/gtest.h>

namespace ecaudit::capture {
namespace {

constexpr std::uint64_t kTicks = 123456789012345678;

TEST(TimeScale, MicrosecondsUnlessTheFileReportsOtherwise) {
  EXPECT_EQ(TimeScale().ToNs(1'795'230'943'188'860), 1'795'230'943'188'860'000);
  EXPECT_EQ(TimeScale().resolution_ns(), 1000);
}

TEST(TimeScale, PowersOfTen) {
  EXPECT_EQ(TimeScale(0, 0).ToNs(7), 7'000'000'000);
  EXPECT_EQ(TimeScale(3, 0).ToNs(7), 7'000'000);
  EXPECT_EQ(TimeScale(6, 0).ToNs(7), 7'000);
  EXPECT_EQ(TimeScale(9, 0).ToNs(kTicks), 123456789012345678);
  EXPECT_EQ(TimeScale(10, 0).ToNs(kTicks), 12345678901234567);
  EXPECT_EQ(TimeScale(12, 0).ToNs(kTicks), 123456789012345);
  EXPECT_EQ(TimeScale(18, 0).ToNs(kTicks), 123456789);
  EXPECT_EQ(TimeScale(28, 0).ToNs(9'999'999'999'999'999'999U), 0);
  EXPECT_EQ(TimeScale(28, 0).ToNs(10'000'000'000'000'000'000U), 1);
  EXPECT_EQ(TimeScale(29, 0).ToNs(std::numeric_limits<std::uint64_t>::max()), 0);
  EXPECT_EQ(TimeScale(27, 0).ToNs(std::numeric_limits<std::uint64_t>::max()), 18);
  EXPECT_EQ(TimeScale(127, 0).ToNs(std::numeric_limits<std::uint64_t>::max()), 0);
}

TEST(TimeScale, PowersOfTwoRoundDown) {
  EXPECT_EQ(TimeScale(0x80, 0).ToNs(7), 7'000'000'000);
  EXPECT_EQ(TimeScale(0x80 | 1, 0).ToNs(3), 1'500'000'000);
  // 3 / 2^30 s = 2.79 ns
  EXPECT_EQ(TimeScale(0x80 | 30, 0).ToNs(3), 2);
  EXPECT_EQ(TimeScale(0x80 | 30, 0).ToNs((1ULL << 30U) * 1'795'230'943 + 3), 1'795'230'943'000'000'002);
  // 5 * 10^9 / 2^63 ns: far below one
  EXPECT_EQ(TimeScale(0x80 | 63, 0).ToNs(5), 0);
  EXPECT_EQ(TimeScale(0x80 | 63, 0).ToNs(std::numeric_limits<std::uint64_t>::max()), 1'999'999'999);
  EXPECT_EQ(TimeScale(0x80 | 127, 0).ToNs(std::numeric_limits<std::uint64_t>::max()), 0);
}

TEST(TimeScale, OffsetInSecondsEitherWay) {
  EXPECT_EQ(TimeScale(6, 1000).ToNs(1), 1'000'000'001'000);
  EXPECT_EQ(TimeScale(6, -1000).ToNs(1'000'000), -999'000'000'000);
  // Half a nanosecond before 1970 is rounded down as well.
  EXPECT_EQ(TimeScale(10, -1).ToNs(9'999'999'995), -1);
}

TEST(TimeScale, WhatNoTimeCanHoldIsNoTime) {
  constexpr auto kMax = std::numeric_limits<TimeNs>::max();
  constexpr auto kLimit = static_cast<std::uint64_t>(kMax);
  EXPECT_EQ(TimeScale(9, 0).ToNs(kLimit), kMax);
  EXPECT_FALSE(TimeScale(9, 0).ToNs(kLimit + 1).has_value());
  EXPECT_FALSE(TimeScale(0, 0).ToNs(std::numeric_limits<std::uint64_t>::max()).has_value());
  EXPECT_FALSE(TimeScale(9, std::numeric_limits<std::int64_t>::max()).ToNs(0).has_value());
  EXPECT_FALSE(TimeScale(9, std::numeric_limits<std::int64_t>::min()).ToNs(0).has_value());
  EXPECT_EQ(TimeScale(9, -1).ToNs(kLimit + 1), kMax - 999'999'999);
}

TEST(TimeScale, StepOfTheStamps) {
  EXPECT_EQ(TimeScale(0, 0).resolution_ns(), 1'000'000'000);
  EXPECT_EQ(TimeScale(8, 0).resolution_ns(), 10);
  EXPECT_EQ(TimeScale(9, 0).resolution_ns(), 1);
  EXPECT_EQ(TimeScale(12, 0).resolution_ns(), 1);
  EXPECT_EQ(TimeScale(127, 0).resolution_ns(), 1);
  EXPECT_EQ(TimeScale(0x80 | 20, 0).resolution_ns(), 954);  // 953.67
  EXPECT_EQ(TimeScale(0x80 | 30, 0).resolution_ns(), 1);
  EXPECT_EQ(TimeScale(0x80 | 127, 0).resolution_ns(), 1);
}

}  // namespace
}  // namespace ecaudit::capture
