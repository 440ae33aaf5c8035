#include "analyzers/sync/arrival_grid.h"

#include <algorithm>
#include <cmath>

namespace ecaudit::sync {

void ArrivalGrid::Begin(TimeBase base, TimeNs cycle_ns) {
  // A median of twenty intervals is wrong by a third of their jitter at most; that of one arrival is the unit.
  constexpr double kFirstCycleVariance = 0.125;
  *this = {};
  base_ = base;
  cycle_ns_ = static_cast<double>(cycle_ns);
  phase_variance_ = 1;
  cycle_variance_ = kFirstCycleVariance;
}

std::optional<ArrivalGrid::Arrival> ArrivalGrid::Add(TimeNs interval_ns) {
  constexpr std::uint64_t kSettle = 100;
  constexpr double kPause = 64;
  const double since = static_cast<double>(interval_ns) + deviation_;
  const double cycles = std::max(std::round(since / cycle_ns_), 0.0);
  // Clocks of a capture may hold anything: a cycle may come out as none.
  if (!(cycles <= kPause) || !(cycle_ns_ > 0)) {
    End();
    return std::nullopt;
  }
  const double deviation = since - cycles * cycle_ns_;
  const double scatter = std::sqrt(square_);  // of the frames before
  const Gains gains = Weigh(cycles);
  Scatter(deviation);
  deviation_ = deviation * (1 - gains.phase);
  cycle_ns_ += deviation * gains.cycle;
  cycles_ += static_cast<std::uint64_t>(cycles);
  if (cycles_ < kSettle) return std::nullopt;
  constexpr double kSigmas = 3;
  Arrival arrival;
  arrival.deviation_ns = static_cast<TimeNs>(deviation);
  arrival.uncertainty_ns = static_cast<TimeNs>(kSigmas * scatter * std::sqrt(gains.phase));
  arrival.missing = cycles < 2 ? 0 : static_cast<std::uint64_t>(cycles) - 1;
  arrival.cycle = cycles_;
  arrival.cycle_ns = static_cast<TimeNs>(cycle_ns_);
  return arrival;
}

/// How much of the deviation is the grid's: all frames count alike until they are many. The drive follows the mean of
/// what comes, slowly: so does the grid, and never stops.
ArrivalGrid::Gains ArrivalGrid::Weigh(double cycles) {
  constexpr double kLeastOfPhase = 1.0 / 256;
  constexpr double kLeastOfCycle = 6.0 / (4096.0 * 4096.0);
  phase_variance_ += cycles * (2 * covariance_ + cycles * cycle_variance_);
  covariance_ += cycles * cycle_variance_;
  const double phase = phase_variance_ / (phase_variance_ + 1);
  const double cycle = covariance_ / (phase_variance_ + 1);
  cycle_variance_ -= cycle * covariance_;
  phase_variance_ -= phase * phase_variance_;
  covariance_ -= phase * covariance_;
  return {std::max(phase, kLeastOfPhase), std::max(cycle, kLeastOfCycle)};
}

void ArrivalGrid::Scatter(double deviation) {
  constexpr std::uint64_t kMost = 1024;
  frames_ = std::min(frames_ + 1, kMost);
  square_ += (deviation * deviation - square_) / static_cast<double>(frames_);
}

}  // namespace ecaudit::sync
