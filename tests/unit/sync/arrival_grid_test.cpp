#include "analyzers/sync/arrival_grid.h"

#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::sync {
namespace {

constexpr TimeNs kUs = 1000;

/// Frames on a grid, each up to `jitter` behind its point, all alike likely.
std::vector<TimeNs> OnGrid(TimeNs cycle, TimeNs jitter, std::size_t frames, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<TimeNs> times;
  for (std::size_t i = 0; i < frames; ++i) {
    const TimeNs behind = jitter > 0 ? static_cast<TimeNs>(random() % static_cast<std::uint32_t>(jitter)) : 0;
    times.push_back(static_cast<TimeNs>(i) * cycle + behind);
  }
  return times;
}

struct Judged {
  TimeNs certain = 0;  ///< largest deviation that is certain
  std::uint64_t missing = 0;
  ArrivalGrid::Arrival last;
};

Judged Follow(const std::vector<TimeNs>& times, TimeNs nominal) {
  ArrivalGrid grid;
  grid.Begin(TimeBase::kCapture, nominal);
  Judged judged;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const auto arrival = grid.Add(times[i] - times[i - 1]);
    EXPECT_EQ(arrival.has_value(), arrival && arrival->cycle >= 100);
    if (!arrival) continue;
    judged.certain = std::max(judged.certain, std::abs(arrival->deviation_ns) - arrival->uncertainty_ns);
    judged.missing += arrival->missing;
    judged.last = *arrival;
  }
  return judged;
}

struct Rhythm {
  TimeNs cycle, jitter;
};
constexpr Rhythm kHealthy[] = {{250 * kUs, 70 * kUs},   {500 * kUs, 60 * kUs},   {500 * kUs, 70 * kUs},
                               {1000 * kUs, 200 * kUs}, {1000 * kUs, 320 * kUs}, {2000 * kUs, 320 * kUs}};

// What the first cycles do not tell of the cycle's length shall not count as deviation, nor as a cycle.
TEST(ArrivalGrid, JitterMakesNoDeviationBeyondItself) {
  for (const auto& [cycle, jitter] : kHealthy) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      for (const TimeNs wrong : {TimeNs{0}, jitter / 4, -jitter / 4}) {
        const Judged judged = Follow(OnGrid(cycle, jitter, 3000, seed), cycle + wrong);
        EXPECT_LE(judged.certain, jitter) << cycle << " seed " << seed << " nominal wrong by " << wrong;
        EXPECT_EQ(judged.missing, 0U);
        EXPECT_EQ(judged.last.cycle, 2999U);
        EXPECT_NEAR(static_cast<double>(judged.last.cycle_ns), static_cast<double>(cycle), 100);
      }
    }
  }
}

// The same with one frame that is off by as much again.
TEST(ArrivalGrid, WhatComesLateBetweenJitteringFramesIsFound) {
  for (const auto& [cycle, jitter] : kHealthy) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      std::vector<TimeNs> times = OnGrid(cycle, jitter / 4, 3000, seed);
      times[120] += jitter + jitter / 4;
      EXPECT_GT(Follow(times, cycle + jitter / 16).certain, jitter) << cycle << " seed " << seed;
    }
  }
}

TEST(ArrivalGrid, FramesThatAreMissingCountOnce) {
  std::vector<TimeNs> times = OnGrid(1000 * kUs, 300 * kUs, 1000, 1);
  times.erase(times.begin() + 500, times.begin() + 503);
  times.erase(times.begin() + 50);  // before the grid is settled
  const Judged judged = Follow(times, 1010 * kUs);
  EXPECT_EQ(judged.missing, 3U);
  EXPECT_EQ(judged.last.cycle, 999U);
}

TEST(ArrivalGrid, AnotherCycleThanTheNominalOneIsFollowed) {
  const Judged judged = Follow(OnGrid(1090 * kUs, 0, 1000, 1), 1000 * kUs);
  EXPECT_LT(judged.certain, 10 * kUs);
  EXPECT_NEAR(static_cast<double>(judged.last.cycle_ns), 1090e3, 10);
}

// A clock that runs away is noticed, one that wanders a little is followed.
TEST(ArrivalGrid, ACycleThatChangesAddsUp) {
  const auto changed = [](TimeNs by) {
    std::vector<TimeNs> times = OnGrid(1000 * kUs, 0, 2000, 1);
    for (TimeNs i = 1; i <= 2000; ++i) times.push_back(1999 * 1000 * kUs + i * (1000 * kUs + by));
    return Follow(times, 1000 * kUs).certain;
  };
  EXPECT_GT(changed(2 * kUs), 320 * kUs);
  EXPECT_GT(changed(-2 * kUs), 320 * kUs);
  EXPECT_LT(changed(kUs / 10), 30 * kUs);
}

TEST(ArrivalGrid, APauseEndsIt) {
  ArrivalGrid grid;
  EXPECT_FALSE(grid.Follows(TimeBase::kNone));
  grid.Begin(TimeBase::kCapture, 1000 * kUs);
  for (int i = 0; i < 200; ++i) grid.Add(1000 * kUs);
  EXPECT_TRUE(grid.Follows(TimeBase::kCapture));
  EXPECT_FALSE(grid.Follows(TimeBase::kDc));
  EXPECT_FALSE(grid.Add(65 * 1000 * kUs));
  EXPECT_FALSE(grid.Follows(TimeBase::kCapture));
}

// Stamps may hold anything.
TEST(ArrivalGrid, IntervalsOfNothingAndOfAgesDoNoHarm) {
  ArrivalGrid grid;
  grid.Begin(TimeBase::kCapture, 1);
  for (int i = 0; i < 300; ++i) grid.Add(0);
  grid.Begin(TimeBase::kCapture, 1000 * kUs);
  for (int i = 0; i < 300; ++i) {
    const auto arrival = grid.Add(i % 3 == 0 ? 0 : 700 * kUs);
    if (arrival) {
      EXPECT_LT(arrival->missing, 64U);
    }
  }
  EXPECT_FALSE(grid.Add(INT64_MAX));
}

}  // namespace
}  // namespace ecaudit::sync
