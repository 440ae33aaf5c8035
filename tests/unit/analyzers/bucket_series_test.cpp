#include "analyzers/collect/bucket_series.h"

#include <random>

#include <gtest/gtest.h>

namespace ecaudit::timeline {
namespace {

constexpr TimeNs kStart = 1'556'712'000'000'000'000;

TEST(BucketSeries, EmptyBeforeTheFirstValue) {
  EXPECT_TRUE(BucketSeries().empty());
}

TEST(BucketSeries, OneValue) {
  BucketSeries series;
  series.Add(kStart, 5);
  ASSERT_EQ(series.series().buckets.size(), 1U);
  EXPECT_EQ(series.series().start, kStart);
  EXPECT_EQ(series.series().buckets[0].least, 5);
  EXPECT_EQ(series.series().buckets[0].most, 5);
  EXPECT_EQ(series.series().buckets[0].count, 1U);
}

TEST(BucketSeries, ValuesBeforeTheFirstAreLeftOut) {
  BucketSeries series;
  series.Add(kStart, 5);
  series.Add(kStart - 1, 7);
  EXPECT_EQ(series.series().buckets[0].count, 1U);
}

// Whatever the length: as many values as were given, the same least and most, each in the bucket of its time, and
// never more buckets than allowed.
TEST(BucketSeries, NothingIsLostWhenBucketsMerge) {
  std::mt19937_64 random(7);
  for (const TimeNs step : {1LL, 1'000LL, 1'000'000LL, 3'600'000'000'000LL}) {
    BucketSeries series;
    std::vector<std::pair<TimeNs, double>> values;
    TimeNs time = kStart;
    for (int i = 0; i < 20'000; ++i) {
      time += static_cast<TimeNs>(random() % static_cast<std::uint64_t>(2 * step + 1));
      values.emplace_back(time, static_cast<double>(random() % 2000) - 1000);
      series.Add(values.back().first, values.back().second);
    }
    const TimeSeries& out = series.series();
    ASSERT_LE(out.buckets.size(), BucketSeries::kBuckets);
    std::uint64_t count = 0;
    for (const TimeSeries::Bucket& bucket : out.buckets) count += bucket.count;
    EXPECT_EQ(count, values.size());
    std::vector<TimeSeries::Bucket> expected(out.buckets.size());
    for (const auto& [at, value] : values) {
      TimeSeries::Bucket& bucket = expected.at(static_cast<std::size_t>((at - out.start) / out.width));
      bucket.least = bucket.count == 0 ? value : std::min(bucket.least, value);
      bucket.most = bucket.count == 0 ? value : std::max(bucket.most, value);
      ++bucket.count;
    }
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_EQ(out.buckets[i].count, expected[i].count) << i;
      if (expected[i].count == 0) continue;
      ASSERT_EQ(out.buckets[i].least, expected[i].least) << i;
      ASSERT_EQ(out.buckets[i].most, expected[i].most) << i;
    }
  }
}

TEST(BucketSeries, BitsOfAllValuesOfABucket) {
  BucketSeries series;
  series.Limit(1);
  for (const double value : {6.0, 3.0, 2.0}) series.Add(kStart, value);
  EXPECT_EQ(series.series().buckets[0].any, 7U);
  EXPECT_EQ(series.series().buckets[0].all, 2U);
  series.Add(kStart + 1'000'000'000, 4);
  ASSERT_EQ(series.series().buckets.size(), 1U);
  EXPECT_EQ(series.series().buckets[0].any, 7U);
  EXPECT_EQ(series.series().buckets[0].all, 0U);
  series.Add(kStart + 1'000'000'000, -1);
  series.Add(kStart + 1'000'000'000, 1e300);
  EXPECT_EQ(series.series().buckets[0].any, 7U);
}

// As when another signal takes its room: what was measured stays, in fewer buckets.
TEST(BucketSeries, AFinerSeriesBecomesCoarser) {
  BucketSeries series;
  series.Limit(6400);
  for (TimeNs i = 0; i < 100'000; ++i) series.Add(kStart + i * 1'000'000, static_cast<double>(i));
  EXPECT_GT(series.series().buckets.size(), 3200U - 1);
  EXPECT_LE(series.series().buckets.size(), 6400U);
  series.Limit(BucketSeries::kBuckets);
  const TimeSeries& out = series.series();
  EXPECT_LE(out.buckets.size(), BucketSeries::kBuckets);
  std::uint64_t count = 0;
  for (const TimeSeries::Bucket& bucket : out.buckets) count += bucket.count;
  EXPECT_EQ(count, 100'000U);
  EXPECT_EQ(out.buckets.front().least, 0);
  EXPECT_EQ(out.buckets.back().most, 99'999);
}

TEST(BucketSeries, UsesMostOfItsBuckets) {
  BucketSeries series;
  for (TimeNs i = 0; i < 100'000; ++i) series.Add(kStart + i * 1'000'000, static_cast<double>(i));
  EXPECT_GT(series.series().buckets.size(), BucketSeries::kBuckets / 2 - 1);
}

TEST(BucketSeries, TheLongestTimeThereIs) {
  BucketSeries series;
  series.Add(0, 1);
  series.Add(std::numeric_limits<TimeNs>::max(), 2);
  EXPECT_LE(series.series().buckets.size(), BucketSeries::kBuckets);
  EXPECT_EQ(series.series().buckets.back().most, 2);
}

TEST(BucketSeries, FromTheEarliestToTheLatestTime) {
  BucketSeries series;
  series.Add(std::numeric_limits<TimeNs>::min(), 1);
  series.Add(std::numeric_limits<TimeNs>::max(), 2);
  EXPECT_LE(series.series().buckets.size(), BucketSeries::kBuckets);
}

}  // namespace
}  // namespace ecaudit::timeline
