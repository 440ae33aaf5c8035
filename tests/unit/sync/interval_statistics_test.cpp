#include "analyzers/sync/interval_statistics.h"

#include <limits>

#include <gtest/gtest.h>

namespace ecaudit::sync {
namespace {

FrameRef Frame(FrameNo number) {
  return {number, 0, true};
}

TEST(IntervalStatistics, NothingMeasured) {
  const IntervalStatistics nothing;
  EXPECT_EQ(nothing.Summary().cycles, 0U);
  EXPECT_EQ(nothing.Percentile(0.5), 0);
}

TEST(IntervalStatistics, MeanDeviationAndExtremes) {
  IntervalStatistics s;
  // Mean 5, sample without correction: deviation 2 (the textbook's example), in milliseconds.
  FrameNo frame = 1;
  for (const TimeNs ms : {2, 4, 4, 4, 5, 5, 7, 9}) {
    s.Add(ms * 1'000'000, Frame(frame), Frame(frame + 1));
    ++frame;
  }
  const CycleSummary summary = s.Summary();
  EXPECT_EQ(summary.cycles, 8U);
  EXPECT_DOUBLE_EQ(summary.mean_us, 5000);
  EXPECT_DOUBLE_EQ(summary.stddev_us, 2000);
  EXPECT_DOUBLE_EQ(summary.min_us, 2000);
  EXPECT_DOUBLE_EQ(summary.max_us, 9000);
  EXPECT_EQ(summary.longest_from.number, 8U);
  EXPECT_EQ(summary.longest_to.number, 9U);
}

TEST(IntervalStatistics, PercentilesAreRightToTwoThousandths) {
  IntervalStatistics s;
  for (TimeNs us = 1; us <= 1000; ++us) s.Add(us * 10'000, Frame(1), Frame(2));
  for (const auto& [share, us] : {std::pair{0.01, 100}, {0.5, 5000}, {0.99, 9900}, {1.0, 10000}}) {
    EXPECT_NEAR(static_cast<double>(s.Percentile(share)), us * 1e3, us * 2.0) << share;
  }
}

TEST(IntervalStatistics, EveryIntervalIsInTheHistogram) {
  IntervalStatistics s;
  for (const TimeNs ns : {TimeNs{0}, TimeNs{1}, TimeNs{1023}, TimeNs{1024}, TimeNs{999'999}, TimeNs{1} << 62}) {
    s.Add(ns, Frame(1), Frame(2));
  }
  for (TimeNs ns = 1; ns < TimeNs{1} << 40; ns += ns / 100 + 1) s.Add(ns, Frame(1), Frame(2));
  const CycleSummary summary = s.Summary();
  std::uint64_t count = 0;
  double end = 0;
  for (const CycleBin& bin : summary.histogram) {
    EXPECT_GE(bin.from_us, end);
    EXPECT_GT(bin.to_us, bin.from_us);
    end = bin.to_us;
    count += bin.count;
  }
  EXPECT_EQ(count, summary.cycles);
  EXPECT_LE(summary.histogram.size(), 100U);
}

TEST(IntervalStatistics, MissingCyclesAndBurstsAgainstTheMedian) {
  IntervalStatistics s;
  for (int i = 0; i < 100; ++i) s.Add(1'000'000, Frame(1), Frame(2));
  s.Add(1'400'000, Frame(1), Frame(2));  // late, not missing
  s.Add(2'000'000, Frame(1), Frame(2));  // one missing
  s.Add(9'000'000, Frame(1), Frame(2));  // eight missing
  s.Add(260'000, Frame(1), Frame(2));
  s.Add(240'000, Frame(1), Frame(2));  // less than a quarter
  const CycleSummary summary = s.Summary();
  EXPECT_EQ(summary.missing, 9U);
  EXPECT_EQ(summary.bursts, 1U);
}

TEST(IntervalStatistics, IntervalsOfCenturiesOverflowNothing) {
  IntervalStatistics s;
  const TimeNs most = std::numeric_limits<TimeNs>::max();
  for (int i = 0; i < 3; ++i) s.Add(most - i, Frame(1), Frame(2));
  const CycleSummary summary = s.Summary();
  EXPECT_EQ(summary.missing, 0U);
  EXPECT_EQ(summary.cycles, 3U);
}

}  // namespace
}  // namespace ecaudit::sync
