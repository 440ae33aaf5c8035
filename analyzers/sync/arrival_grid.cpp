#include "analyzers/sync/arrival_grid.h"

#include <algorithm>
#include <cmath>

namespace ecaudit::sync {

std::optional<ArrivalGrid::Arrival> ArrivalGrid::Add(const Interval& interval, TimeNs nominal_ns) {
  constexpr std::uint64_t kSettle = 100;
  constexpr double kPause = 64;
  const bool restart = interval.base == TimeBase::kNone || interval.base != base_;
  const double mean = cycles_ >= kSettle ? ns_ / static_cast<double>(cycles_) : static_cast<double>(nominal_ns);
  const double cycles = std::round((static_cast<double>(interval.ns) + deviation_) / mean);
  // Clocks of a capture may hold anything: an interval may be none, or negative.
  if (restart || !(std::abs(cycles) <= kPause)) {
    base_ = interval.base;
    cycles_ = 0;
    ns_ = deviation_ = 0;
    return std::nullopt;
  }
  // The drive follows the mean of what comes, slowly: so does the grid.
  const double follow = std::min(256.0, static_cast<double>(cycles_) + 1);
  deviation_ = deviation_ * (1 - 1 / follow) + static_cast<double>(interval.ns) - cycles * mean;
  cycles_ = static_cast<std::uint64_t>(
      std::max<std::int64_t>(static_cast<std::int64_t>(cycles_) + static_cast<std::int64_t>(cycles), 0));
  ns_ += static_cast<double>(interval.ns);
  if (cycles_ < kSettle) return std::nullopt;
  const std::uint64_t missing = cycles < 2 ? 0 : static_cast<std::uint64_t>(cycles) - 1;
  return Arrival{static_cast<TimeNs>(deviation_), missing, cycles_, static_cast<TimeNs>(mean)};
}

}  // namespace ecaudit::sync
