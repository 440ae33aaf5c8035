#include "analyzers/sync/time_trust.h"

#include <algorithm>

namespace ecaudit::sync {
namespace {

/// Round trips that a percentile has to rest on.
constexpr std::uint64_t kEnough = 20;
/// One tick of the clocks of ESCs and probes, twice.
constexpr TimeNs kTicks = 40;
/// Stamps of a host, when the capture has no round trips to evaluate them by (esc-reference 10.3).
constexpr TimeNs kHostStamps = 500'000;
/// Steps of stamps from which on both copies of a frame often have the same.
constexpr TimeNs kCoarseStep = 50'000;

}  // namespace

std::optional<TimeNs> TimeTrust::UsualRoundTrip() const {
  const auto uncertainty = Uncertainty(TimeBase::kCapture);
  if (!uncertainty || round_trips_.count() < kEnough) return std::nullopt;
  return round_trips_.Percentile(0.99) + *uncertainty;
}

bool TimeTrust::IsCoarse() const {
  return pipeline_.statistics().time_step_ns >= kCoarseStep;
}

std::optional<TimeNs> TimeTrust::UncertaintyOfPause(TimeBase base) const {
  const PipelineStatistics& read = pipeline_.statistics();
  if (base != TimeBase::kCapture || !IsCoarse()) return Uncertainty(base);
  if (read.backwards > 0 || read.without_time > 0) return std::nullopt;
  return kHostStamps + 2 * read.time_step_ns;
}

std::optional<TimeNs> TimeTrust::Uncertainty(TimeBase base) const {
  if (base == TimeBase::kDc || base == TimeBase::kEsl) return kTicks;
  if (base == TimeBase::kNone) return std::nullopt;
  const PipelineStatistics& read = pipeline_.statistics();
  const bus::PairingStatistics& pairing = pipeline_.pairing();
  if (read.backwards > 0 || read.without_time > 0 || IsCoarse()) return std::nullopt;
  if (pairing.identical_stamps > 2 && pairing.identical_stamps * 10 >= pairing.paired) return std::nullopt;
  const TimeNs step = std::max<TimeNs>(read.time_step_ns, 1);
  if (round_trips_.count() < kEnough) return kHostStamps + step;
  // A frame takes the same way every time: what round trips differ by is the host's doing.
  return (round_trips_.Percentile(0.99) - round_trips_.Percentile(0.01) + 1) / 2 + step;
}

}  // namespace ecaudit::sync
