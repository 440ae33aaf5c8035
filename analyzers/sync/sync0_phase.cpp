#include "analyzers/sync/sync0_phase.h"

#include <algorithm>
#include <cmath>

#include "decoder/base/wrapping.h"

namespace ecaudit::sync {
namespace {

/// How well the slaves' clocks agree with the reference when nothing says better: what counts as synchronised.
constexpr TimeNs kClocksAgree = 1000;

}  // namespace

Sync0Phase::Arrival Sync0Phase::Add(const DcUnit& unit, const FrameRef& frame, const DcTime& now, bool wide,
                                    std::int64_t way_ns, TimeNs doubt_ns) {
  Arrival arrival;
  const SyncSettings& settings = *unit.active();
  Follow(settings, now, wide);
  const auto cycle = static_cast<std::int64_t>(*settings.sync0_cycle_ns);
  // Clocks come from the capture and may hold anything: unsigned numbers wrap where signed ones must not.
  const auto since = static_cast<std::int64_t>(WrappingDifference(
      WrappingSum(now.ns, static_cast<std::uint64_t>(way_ns)), static_cast<std::uint64_t>(start_ns_)));
  constexpr std::int64_t kNever = std::int64_t{1} << 62U;
  uncertainty_ = std::max<TimeNs>(kClocksAgree, unit.last_difference_ns().value_or(0)) + doubt_ns;
  if (since < uncertainty_ || since > kNever) {  // SYNC0 has not begun
    has_slot_ = false;
    return arrival;
  }
  arrival.measured = true;
  const std::int64_t pulses = PulsesBefore(since, cycle);
  arrival.phase_ns = since - pulses * cycle;
  Count(frame, arrival.phase_ns, cycle);
  Place(arrival, since, pulses, cycle);
  return arrival;
}

/// How often SYNC0 came since its first pulse: mostly once more than at the last frame, which spares a division.
std::int64_t Sync0Phase::PulsesBefore(std::int64_t since, std::int64_t cycle) {
  const std::int64_t later = since - last_pulse_;
  if (last_pulse_ >= 0 && later >= cycle && later < 2 * cycle) {
    ++pulses_;
    last_pulse_ += cycle;
  } else {
    pulses_ = since / cycle;
    last_pulse_ = pulses_ * cycle;
  }
  return pulses_;
}

/// Settings or clock may be others than at the last frame.
void Sync0Phase::Follow(const SyncSettings& settings, const DcTime& now, bool wide) {
  if (settings_frame_.number == settings.frame.number && epoch_ == now.epoch) return;
  settings_frame_ = settings.frame;
  epoch_ = now.epoch;
  has_slot_ = false;
  last_pulse_ = -1;
  start_ns_ = static_cast<std::int64_t>(
      settings.start_is_64_bit && wide ? *settings.start_ns
                                       : esc::UnwrapDcTime(static_cast<std::uint32_t>(*settings.start_ns), now.ns));
}

void Sync0Phase::Count(const FrameRef& frame, TimeNs phase, std::int64_t cycle) {
  const TimeNs margin = std::min(phase, cycle - phase);
  if (frames_ == 0 || phase < min_) min_ = phase;
  if (frames_ == 0 || phase > max_) max_ = phase;
  if (frames_ == 0 || margin < margin_) {
    margin_ = margin;
    margin_frame_ = frame;
  }
  ++frames_;
  const auto value = static_cast<double>(phase);
  const double delta = value - mean_;
  mean_ += delta / static_cast<double>(frames_);
  squares_ += delta * (value - mean_);
  // Divisions of 32 bit are several times as fast.
  const auto scaled = static_cast<std::uint64_t>(phase) * bins_.size();
  const std::uint64_t bin = scaled <= UINT32_MAX
                                ? static_cast<std::uint32_t>(scaled) / static_cast<std::uint32_t>(cycle)
                                : scaled / static_cast<std::uint64_t>(cycle);
  ++bins_[std::min<std::uint64_t>(bin, bins_.size() - 1)];
}

/// Near a pulse nobody can say on which side of it the frame arrived.
void Sync0Phase::Place(Arrival& arrival, std::int64_t since, std::int64_t pulses, std::int64_t cycle) {
  const TimeNs phase = arrival.phase_ns;
  const bool narrow = uncertainty_ < cycle;
  const std::int64_t least = narrow ? pulses - (phase < uncertainty_) : (since - uncertainty_) / cycle;
  const std::int64_t most = narrow ? pulses + (phase >= cycle - uncertainty_) : (since + uncertainty_) / cycle;
  const std::int64_t between = least - slot_most_;
  if (has_slot_ && most <= slot_least_) {
    arrival.doubled = true;
    ++doubled_;
  } else if (has_slot_ && between >= 2) {
    arrival.empty = static_cast<std::uint64_t>(between - 1);
    empty_ += arrival.empty;
  }
  has_slot_ = true;
  slot_least_ = least;
  slot_most_ = most;
}

SyncPhase Sync0Phase::Summary(std::uint32_t cycle_ns) const {
  SyncPhase phase;
  phase.frames = frames_;
  phase.cycle_ns = cycle_ns;
  phase.mean_us = mean_ / 1e3;
  phase.min_us = static_cast<double>(min_) / 1e3;
  phase.max_us = static_cast<double>(max_) / 1e3;
  phase.stddev_us = std::sqrt(squares_ / static_cast<double>(frames_)) / 1e3;
  phase.margin_us = static_cast<double>(margin_) / 1e3;
  phase.margin_frame = margin_frame_;
  phase.empty_intervals = empty_;
  phase.double_intervals = doubled_;
  phase.uncertainty_us = static_cast<double>(uncertainty_) / 1e3;
  phase.histogram.assign(bins_.begin(), bins_.end());
  return phase;
}

}  // namespace ecaudit::sync
