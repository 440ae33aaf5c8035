/// in: intervals in ns.  out: mean, deviation, extremes and percentiles, in memory that does not grow.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/result/cycle_summary.h"
#include "decoder/base/ids.h"

namespace ecaudit::sync {

/// 512 bins an octave, so that a percentile is right to 0.2 %, from 1.024 us to 68 s; shorter and longer intervals
/// count in the outermost bins. About 53 KiB, taken with the first interval.
class IntervalHistogram {
 public:
  /// @param ns the interval, not negative
  /// @return whether none was as long
  bool Add(TimeNs ns);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Interval that `share` (0 to 1) of all do not exceed, ns; 0 when there is none.
  [[nodiscard]] TimeNs Percentile(double share) const;
  /// 98 of 100 intervals lie within this, ns.
  [[nodiscard]] TimeNs Width() const { return Percentile(0.99) - Percentile(0.01); }
  [[nodiscard]] TimeNs longest() const { return max_; }

 protected:
  std::uint64_t count_ = 0;
  TimeNs min_ = 0, max_ = 0;
  std::vector<std::uint32_t> bins_;
};

/// Besides, mean and deviation, and between which frames the longest one lies.
class IntervalStatistics : public IntervalHistogram {
 public:
  /// @param ns the interval, not negative  @param from, to frames it lies between
  void Add(TimeNs ns, const FrameRef& from, const FrameRef& to);

  [[nodiscard]] double mean_ns() const { return mean_; }
  [[nodiscard]] TimeNs max_ns() const { return max_; }
  /// Everything measured, in us; cycles is 0 when nothing was.
  [[nodiscard]] CycleSummary Summary() const;

 private:
  double mean_ = 0, sum_of_squares_ = 0;
  FrameRef longest_from_, longest_to_;
};

}  // namespace ecaudit::sync
