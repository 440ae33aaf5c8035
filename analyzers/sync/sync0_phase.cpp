#include "analyzers/sync/sync0_phase.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::sync {
Sync0Phase::Arrival Sync0Phase::Add(const DcUnit& unit, const FrameRef& frame, const DcTime& now, bool wide,
                                    std::int64_t way_ns, TimeNs doubt_ns) {
  Arrival arrival;
  const SyncSettings& settings = *unit.active();
  Follow(settings, frame, now, wide);
  if (!has_start_) return arrival;
  const auto cycle = static_cast<std::int64_t>(unit.pulse_cycle_ns());
  const std::int64_t since = Since(now, way_ns);
  uncertainty_ = UncertaintyOf(unit) + doubt_ns;
  if (since < uncertainty_ || since > kNever) {  // SYNC0 has not begun
    has_slot_ = false;
    return arrival;
  }
  arrival.measured = true;
  const std::int64_t pulses = PulsesBefore(since, cycle);
  arrival.phase_ns = since - pulses * cycle;
  Count(frame, arrival.phase_ns, cycle);
  const Slot slot = SlotOf(since, pulses, cycle, uncertainty_);
  if (slot.least != slot.most && undecided_++ == 0) first_undecided_ = frame;
  Place(arrival, slot);
  // One stamp in a hundred is worse than the uncertainty of stamps: it must not count against a whole capture.
  const bool by_stamps = doubt_ns > 0;
  const Slot firm = by_stamps ? SlotOf(since, pulses, cycle, std::max(uncertainty_, cycle / 4)) : slot;
  Carry(arrival, frame, firm, has_slot_ && !arrival.missed() && since - since_ < cycle + cycle / 2);
  CountMisses(arrival, slot.least != slot.most);
  has_slot_ = true;
  slot_ = slot;
  since_ = since;
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
void Sync0Phase::Follow(const SyncSettings& settings, const FrameRef& frame, const DcTime& now, bool wide) {
  if (settings_frame_.number == settings.frame.number && epoch_ == now.epoch) return;
  if (settings_frame_.number != settings.frame.number) begins_anew_ = true;
  settings_frame_ = settings.frame;
  epoch_ = now.epoch;
  has_slot_ = false;
  last_pulse_ = -1;
  const std::optional<std::uint64_t> start = StartOf(settings, frame, now, wide);
  has_start_ = start.has_value();
  start_ns_ = start.value_or(0);
}

/// The first pulse, by the clock. What it reads at the frame at hand may have wrapped since SYNC was switched on, and
/// no cycle goes into 2^32 ns: the time since then, which the stamps show, leads to the lap that was meant.
std::optional<std::uint64_t> Sync0Phase::StartOf(const SyncSettings& settings, const FrameRef& frame, const DcTime& now,
                                                 bool wide) {
  if (settings.start_is_64_bit && wide) return settings.start_ns;
  if (!settings.frame.has_time || !frame.has_time) return std::nullopt;
  const TimeNs since = Elapsed(settings.frame.time, frame.time);
  const std::uint64_t switched_on = WrappingDifference(now.ns, static_cast<std::uint64_t>(since));
  const std::uint64_t start = esc::UnwrapDcTime(static_cast<std::uint32_t>(*settings.start_ns), switched_on);
  const TimeNs off = std::abs(static_cast<TimeNs>(WrappingDifference(start, switched_on)));
  // Two clocks of 100 ppm each: after hours they may be a lap apart.
  constexpr TimeNs kDrift = 5000;
  constexpr TimeNs kHalfLap = TimeNs{1} << 31;
  if (std::abs(since) / kDrift >= kHalfLap - off) return std::nullopt;
  return start;
}

/// What was found stays found.
void Sync0Phase::BeginStatistics(TimeNs phase, std::int64_t cycle) {
  begins_anew_ = false;
  origin_ = min_ = phase;
  max_ = phase - 1;
  margin_ = cycle;
  frames_ = 0;
  sum_ = squares_ = 0;
  bins_ = {};
  misses_ = {};
}

void Sync0Phase::Extend(const FrameRef& frame, TimeNs phase, std::int64_t cycle) {
  min_ = std::min(min_, phase);
  max_ = std::max(max_, phase);
  const TimeNs margin = std::min(phase, cycle - phase);
  if (margin < margin_) {
    margin_ = margin;
    margin_frame_ = frame;
  }
}

void Sync0Phase::CountMisses(const Arrival& arrival, bool undecided) {
  misses_.empty += arrival.empty;
  misses_.doubled += arrival.doubled ? 1 : 0;
  misses_.longest = std::max(misses_.longest, arrival.empty);
  misses_.undecided += undecided ? 1 : 0;
}

/// Near a pulse it is unknown on which side of it the frame arrived.
Sync0Phase::Slot Sync0Phase::SlotOf(std::int64_t since, std::int64_t pulses, std::int64_t cycle, TimeNs uncertainty) {
  const TimeNs phase = since - pulses * cycle;
  if (uncertainty >= cycle) return {(since - uncertainty) / cycle, (since + uncertainty) / cycle};
  return {pulses - (phase < uncertainty), pulses + (phase >= cycle - uncertainty)};
}

/// The frame against the one before it.
void Sync0Phase::Place(Arrival& arrival, const Slot& slot) {
  if (!has_slot_) return;
  const std::int64_t between = slot.least - slot_.most;
  if (slot.most <= slot_.least) {
    arrival.doubled = true;
    ++doubled_;
  } else if (between >= 2) {
    arrival.empty = static_cast<std::uint64_t>(between - 1);
    empty_ += arrival.empty;
  }
}

/// The frame against all before it that followed each other without a pause. While each interval has its frame, pulses
/// lead by the same number; what every frame leaves possible of it is kept, until nothing is left.
/// @param follows no frame can be missing before it
void Sync0Phase::Carry(Arrival& arrival, const FrameRef& frame, const Slot& slot, bool follows) {
  const auto count = static_cast<std::int64_t>(frames_);
  const std::int64_t least = slot.least - count;
  const std::int64_t most = slot.most - count;
  const bool raised = !follows || least >= least_.pulses;
  const bool lowered = !follows || most <= most_.pulses;
  if (raised) least_ = {least, frames_, frame};
  if (lowered) most_ = {most, frames_, frame};
  const std::int64_t ahead = least_.pulses - most_.pulses;
  if (ahead <= 0) return;
  // The frame at hand moved only one of both: with itself it agrees.
  const Lead& other = raised ? most_ : least_;
  arrival.since = other.frame;
  arrival.frames = frames_ - other.frames;
  arrival.doubled = lowered;
  if (raised) {
    arrival.empty = static_cast<std::uint64_t>(ahead);
    empty_ += arrival.empty;
  } else {
    ++doubled_;
  }
  least_ = {least, frames_, frame};
  most_ = {most, frames_, frame};
}

TimeNs Sync0Phase::UsualNs(TimeNs cycle) const {
  const auto count = static_cast<double>(bins_.size());
  double x = 0, y = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    const double angle = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / count;
    x += static_cast<double>(bins_[i]) * std::cos(angle);
    y += static_cast<double>(bins_[i]) * std::sin(angle);
  }
  const double turns = std::atan2(y, x) / (2 * std::numbers::pi);
  return static_cast<TimeNs>((turns < 0 ? turns + 1 : turns) * static_cast<double>(cycle));
}

SyncPhase Sync0Phase::Summary(std::uint32_t cycle_ns) const {
  SyncPhase phase;
  phase.frames = frames_;
  phase.cycle_ns = cycle_ns;
  const auto count = static_cast<long double>(frames_);
  const long double apart = static_cast<long double>(sum_) / count;
  double mean = static_cast<double>(static_cast<long double>(origin_) + apart);
  if (mean < 0) mean += cycle_ns;
  if (mean >= cycle_ns) mean -= cycle_ns;
  phase.mean_us = mean / 1e3;
  phase.min_us = static_cast<double>(min_) / 1e3;
  phase.max_us = static_cast<double>(max_) / 1e3;
  const long double variance = static_cast<long double>(squares_) / count - apart * apart;
  phase.stddev_us = static_cast<double>(std::sqrt(std::max(variance, 0.0L))) / 1e3;
  phase.margin_us = static_cast<double>(margin_) / 1e3;
  phase.margin_frame = margin_frame_;
  phase.empty_intervals = empty_;
  phase.double_intervals = doubled_;
  phase.uncertainty_us = static_cast<double>(uncertainty_) / 1e3;
  phase.histogram.assign(bins_.begin(), bins_.end());
  return phase;
}

}  // namespace ecaudit::sync
