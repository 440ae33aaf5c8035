#include "analyzers/sync/sync0_phase.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::sync {
namespace {

/// How well the slaves' clocks agree with the reference if nothing better is known: what counts as synchronised.
constexpr TimeNs kClocksAgree = 1000;

}  // namespace

Sync0Phase::Arrival Sync0Phase::Add(const DcUnit& unit, const FrameRef& frame, const DcTime& now, bool wide,
                                    std::int64_t way_ns, TimeNs doubt_ns) {
  Arrival arrival;
  const SyncSettings& settings = *unit.active();
  Follow(settings, frame, now, wide);
  if (!has_start_) return arrival;
  const auto cycle = static_cast<std::int64_t>(*settings.sync0_cycle_ns);
  // Clocks come from the capture and may hold anything: unsigned numbers wrap where signed ones must not.
  const auto since =
      static_cast<std::int64_t>(WrappingDifference(WrappingSum(now.ns, static_cast<std::uint64_t>(way_ns)), start_ns_));
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
  const Slot slot = SlotOf(since, pulses, cycle, uncertainty_);
  if (slot.least != slot.most && undecided_++ == 0) first_undecided_ = frame;
  Place(arrival, slot);
  // One stamp in a hundred is worse than the uncertainty of stamps: it must not count against a whole capture.
  const bool by_stamps = doubt_ns > 0;
  const Slot firm = by_stamps ? SlotOf(since, pulses, cycle, std::max(uncertainty_, cycle / 4)) : slot;
  Carry(arrival, frame, firm, has_slot_ && !arrival.missed() && since - since_ < cycle + cycle / 2);
  has_slot_ = true;
  slot_ = slot;
  since_ = since;
  last_frame_ = frame.number;
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
void Sync0Phase::ForgetStatistics(TimeNs origin) {
  begins_anew_ = false;
  origin_ = origin;
  frames_ = 0;
  sum_ = squares_ = 0;
  bins_ = {};
}

void Sync0Phase::Count(const FrameRef& frame, TimeNs phase, std::int64_t cycle) {
  if (begins_anew_) [[unlikely]]
    ForgetStatistics(phase);
  const TimeNs margin = std::min(phase, cycle - phase);
  if (frames_ == 0 || phase < min_) min_ = phase;
  if (frames_ == 0 || phase > max_) max_ = phase;
  if (frames_ == 0 || margin < margin_) {
    margin_ = margin;
    margin_frame_ = frame;
  }
  ++frames_;
  const TimeNs apart = Apart(phase, cycle);
  sum_ += apart;
  squares_ += Signed128{apart} * apart;
  ++bins_[BinOf(phase, cycle)];
}

std::size_t Sync0Phase::BinOf(TimeNs phase, std::int64_t cycle) const {
  // Divisions of 32 bit are several times as fast.
  const auto scaled = static_cast<std::uint64_t>(phase) * bins_.size();
  const std::uint64_t bin = scaled <= UINT32_MAX
                                ? static_cast<std::uint32_t>(scaled) / static_cast<std::uint32_t>(cycle)
                                : scaled / static_cast<std::uint64_t>(cycle);
  return std::min<std::uint64_t>(bin, bins_.size() - 1);
}

/// The last phase, and by how much each of the run differs from it, is all that Add() would ask for.
void Sync0Phase::AddRun(const PhaseRun& run) {
  const auto count = static_cast<std::int64_t>(run.shifts_ns.size());
  CountRun(run, since_ - last_pulse_);
  pulses_ += count;
  last_pulse_ += count * run.cycle_ns;
  since_ += count * run.cycle_ns + run.shifts_ns.back();
  slot_ = {pulses_, pulses_};
  last_frame_ = run.last.number;
  // Each had its pulse: they lead by the same number all the time, and the last frame is the newest to show it.
  const std::int64_t lead = pulses_ - static_cast<std::int64_t>(frames_);
  if (lead >= least_.pulses) least_ = {lead, frames_, run.last};
  if (lead <= most_.pulses) most_ = {lead, frames_, run.last};
}

/// Count() of each frame of the run.
/// @param phase of the frame before it
void Sync0Phase::CountRun(const PhaseRun& run, TimeNs phase) {
  const auto count = static_cast<std::int64_t>(run.shifts_ns.size());
  const TimeNs least = phase + run.least.shift_ns;
  const TimeNs most = phase + run.most.shift_ns;
  min_ = std::min(min_, least);
  max_ = std::max(max_, most);
  // Of all between two phases one of these two is nearest to a pulse; of two equal ones the first counts.
  const TimeNs of_least = std::min(least, run.cycle_ns - least);
  const TimeNs of_most = std::min(most, run.cycle_ns - most);
  const bool at_most = of_most < of_least || (of_most == of_least && run.most.frame.number < run.least.frame.number);
  if (const TimeNs margin = std::min(of_least, of_most); margin < margin_) {
    margin_ = margin;
    margin_frame_ = at_most ? run.most.frame : run.least.frame;
  }
  frames_ += run.shifts_ns.size();
  const TimeNs apart = Apart(least, run.cycle_ns) - run.least.shift_ns;
  if (Apart(most, run.cycle_ns) - run.most.shift_ns == apart) {  // nothing between goes the other way round
    sum_ += Signed128{apart} * count + run.sum;
    squares_ += Signed128{apart} * apart * count + Signed128{2 * apart} * run.sum + run.squares;
  } else {
    for (const std::int32_t shift : run.shifts_ns) {
      const TimeNs one = Apart(phase + shift, run.cycle_ns);
      sum_ += one;
      squares_ += Signed128{one} * one;
    }
  }
  const std::size_t first_bin = BinOf(least, run.cycle_ns);
  if (BinOf(most, run.cycle_ns) == first_bin) {
    bins_[first_bin] += run.shifts_ns.size();
  } else {
    for (const std::int32_t shift : run.shifts_ns) ++bins_[BinOf(phase + shift, run.cycle_ns)];
  }
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
