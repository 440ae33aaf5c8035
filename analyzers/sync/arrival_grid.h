/// in: intervals between frames with outputs for one slave without SYNC0.  out: how far each lies from where the cycles
/// so far put it.
///
/// keeps: the line through these frames, as a Kalman filter: where the last cycle should have been, how long one is,
/// and how well either is known.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/sync/time_base.h"

namespace ecaudit::sync {

class ArrivalGrid {
 public:
  struct Arrival {
    TimeNs deviation_ns = 0;    ///< positive: late
    TimeNs uncertainty_ns = 0;  ///< of it, as far as the frames before scatter
    std::uint64_t missing = 0;  ///< cycles without process data before it
    std::uint64_t cycle = 0;    ///< ordinal of the cycle that it counts for
    TimeNs cycle_ns = 0;        ///< mean so far
  };

  /// The grid goes on with intervals by this clock.
  [[nodiscard]] bool Follows(TimeBase base) const { return base != TimeBase::kNone && base == base_; }
  /// @param cycle_ns about how long a cycle is, > 0; the intervals show how long it is exactly
  void Begin(TimeBase base, TimeNs cycle_ns);
  /// @return nothing while the grid is not good enough for an evaluation, and where a pause ends it
  std::optional<Arrival> Add(TimeNs interval_ns);
  /// The rhythm does not reach over here: what comes next begins a new one.
  void End() { base_ = TimeBase::kNone; }

 private:
  struct Gains {
    double phase = 0, cycle = 0;
  };
  Gains Weigh(double cycles);
  void Scatter(double deviation);

  TimeBase base_ = TimeBase::kNone;
  std::uint64_t cycles_ = 0;
  std::uint64_t frames_ = 0;  // that square_ rests on
  double cycle_ns_ = 0;
  double deviation_ = 0;  // of the last frame, ns
  double square_ = 0;     // mean of the deviations' squares
  // How uncertain place and length of the cycle are, in parts of the variance of one arrival.
  double phase_variance_ = 0, covariance_ = 0, cycle_variance_ = 0;
};

}  // namespace ecaudit::sync
