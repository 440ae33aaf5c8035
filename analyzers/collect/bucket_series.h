/// in: values in the order of time.  out: TimeSeries of at most as many buckets as the limit, kBuckets unless set.
///
/// The width of a bucket doubles, and neighbours merge, whenever the time no longer fits. Memory is constant; a peak
/// stays in the least and the most of its bucket, and a bit that was ever set or ever clear in `any` and `all`.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "analyzers/result/timeline.h"

namespace ecaudit::timeline {

class BucketSeries {
 public:
  static constexpr std::size_t kBuckets = 800;
  static constexpr TimeNs kFirstWidth = 1024;

  /// @param time  capture clock; values from before the first one are left out
  void Add(TimeNs time, double value) {
    if (series_.width == 0) Begin(time);
    if (time < series_.start) return;
    auto at = static_cast<std::uint64_t>(time) - static_cast<std::uint64_t>(series_.start);
    while (at / static_cast<std::uint64_t>(series_.width) >= limit_) Halve();
    at /= static_cast<std::uint64_t>(series_.width);
    if (series_.buckets.size() <= at) series_.buckets.resize(at + 1);
    TimeSeries::Bucket& bucket = series_.buckets[at];
    bucket.least = bucket.count == 0 ? value : std::min(bucket.least, value);
    bucket.most = bucket.count == 0 ? value : std::max(bucket.most, value);
    const std::uint32_t bits = AsBits(value);
    bucket.any |= bits;
    bucket.all = bucket.count == 0 ? bits : bucket.all & bits;
    ++bucket.count;
  }
  /// At most `limit` buckets, at least 1, from now on: where there are more, neighbours merge.
  void Limit(std::size_t limit) {
    limit_ = limit;
    while (series_.buckets.size() > limit_) Halve();
  }
  [[nodiscard]] const TimeSeries& series() const { return series_; }
  [[nodiscard]] bool empty() const { return series_.empty(); }

 private:
  void Begin(TimeNs time) {
    series_.start = time;
    series_.width = kFirstWidth;
  }
  void Halve() {
    std::vector<TimeSeries::Bucket>& b = series_.buckets;
    const std::size_t half = (b.size() + 1) / 2;
    for (std::size_t i = 0; i < half; ++i) {
      TimeSeries::Bucket merged = b[2 * i];
      if (2 * i + 1 < b.size() && b[2 * i + 1].count > 0) {
        const TimeSeries::Bucket& other = b[2 * i + 1];
        merged.least = merged.count == 0 ? other.least : std::min(merged.least, other.least);
        merged.most = merged.count == 0 ? other.most : std::max(merged.most, other.most);
        merged.all = merged.count == 0 ? other.all : merged.all & other.all;
        merged.any |= other.any;
        merged.count += other.count;
      }
      b[i] = merged;
    }
    b.resize(half);
    series_.width *= 2;
  }

  /// 0 for what is no field of at most 32 bits.
  static std::uint32_t AsBits(double value) {
    constexpr double kEnd = 4294967296.0;
    return value >= 0 && value < kEnd ? static_cast<std::uint32_t>(value) : 0;
  }

  std::size_t limit_ = kBuckets;
  TimeSeries series_;
};

}  // namespace ecaudit::timeline
