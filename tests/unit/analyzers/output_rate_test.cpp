// When intervals are those of another rhythm, and when frames are only missing between them.
#include "analyzers/sync/output_rate.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::sync {
namespace {

constexpr TimeNs kMs = 1'000'000;

/// Adds intervals to a rate, as frames in OP come.
struct Frames {
  OutputRate rate;
  CyclicImage image;
  FrameRef last{1, 0, true};

  /// @return whether the rate came to another rhythm at any of them
  bool Come(const std::vector<TimeNs>& intervals, bool frames_missing = false) {
    bool turned = false;
    for (const TimeNs ns : intervals) {
      if (!rate.Follows(image)) turned = rate.Renew(image, kMs, frames_missing) || turned;
      const FrameRef to{last.number + 2, last.time + ns, true};
      rate.Add({ns, TimeBase::kCapture}, last, to);
      last = to;
    }
    return turned;
  }
};

Frames InACycleOfOneMs() {
  Frames frames;
  frames.image.nominal_ns = kMs;
  frames.image.nominal_of = kEnoughIntervals;
  EXPECT_FALSE(frames.Come(std::vector<TimeNs>(100, kMs)));
  EXPECT_EQ(frames.rate.cycles(), 100U);
  return frames;
}

TEST(OutputRate, FramesThatComeAtAnotherDistanceAreAnotherRhythm) {
  Frames frames = InACycleOfOneMs();
  EXPECT_TRUE(frames.Come(std::vector<TimeNs>(2 * kEnoughIntervals, 5 * kMs)));
}

TEST(OutputRate, NoOtherRhythmIsToldWhereFramesAreMissing) {
  Frames frames = InACycleOfOneMs();
  EXPECT_FALSE(frames.Come(std::vector<TimeNs>(2 * kEnoughIntervals, 5 * kMs), true));
}

TEST(OutputRate, DistancesThatAllDifferAreNoRhythm) {
  Frames frames = InACycleOfOneMs();
  std::vector<TimeNs> intervals;
  for (std::uint64_t i = 0; i < 2 * kEnoughIntervals; ++i) intervals.push_back((i % 2 == 0 ? 2 : 9) * kMs);
  EXPECT_FALSE(frames.Come(intervals));
}

}  // namespace
}  // namespace ecaudit::sync
