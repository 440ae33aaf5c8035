/// in: intervals between frames with outputs for one slave without SYNC0.  out: how far each lies from where the cycles
/// so far put it.
///
/// keeps: the number and length of these cycles, pauses left out.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/sync/time_base.h"

namespace ecaudit::sync {

class ArrivalGrid {
 public:
  struct Arrival {
    TimeNs deviation_ns = 0;    ///< positive: late
    std::uint64_t missing = 0;  ///< cycles without process data before it
    std::uint64_t cycle = 0;    ///< ordinal of the cycle that it counts for
    TimeNs cycle_ns = 0;        ///< mean so far
  };

  /// @param nominal_ns median of the cycle, while there are too few for a mean
  /// @return nothing while the grid is not good enough to judge by
  std::optional<Arrival> Add(const Interval& interval, TimeNs nominal_ns);
  /// The rhythm does not reach over here: what comes next begins a new one.
  void End() { base_ = TimeBase::kNone; }

 private:
  std::uint64_t cycles_ = 0;
  TimeBase base_ = TimeBase::kNone;
  double ns_ = 0;         // length of cycles_ cycles
  double deviation_ = 0;  // of the last frame, ns
};

}  // namespace ecaudit::sync
