#include "analyzers/progress/setpoint_check.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace ecaudit::progress {
namespace {

/// Less is nothing in any unit that drives use.
constexpr std::int64_t kLeastJump = 500;
/// As many times what the target moves in a cycle otherwise.
constexpr std::int64_t kTimesStep = 50;
constexpr std::int64_t kTimesLater = 10;  ///< likewise of the steps that follow
constexpr std::uint32_t kCyclesAfter = 3;
constexpr TimeNs kReactionNs = 500'000'000;
constexpr std::uint32_t kSpikeCycles = 3;
constexpr std::uint32_t kQuietCycles = 20;
constexpr TimeNs kSpikeNs = 50'000'000;
constexpr TimeNs kEchoNs = 500'000'000;
constexpr std::uint64_t kEchoes = 50;
constexpr std::int64_t kOtherSpeed = 2;  ///< between steps in whole increments
constexpr std::uint64_t kReturns = 50;
constexpr std::int64_t kReturnShare = 8;  ///< how near it comes back, and how little the axis follows
constexpr TimeNs kOutsideNs = 100'000'000;
/// A slow motion in whole increments has cycles without a step.
constexpr std::int64_t kLeastStep = 10;
/// A target that stays for longer rests.
constexpr std::uint32_t kMostWaited = 20;
constexpr std::uint64_t kWaits = 50;
constexpr std::uint64_t kWaitsOneIn = 20;   ///< of the cycles in motion, where it is uneven
constexpr std::uint64_t kPromptOneIn = 20;  ///< of the steps at most, where the target is slower than the cycle

}  // namespace

void SetpointCheck::Step(const AxisView& now, AxisRecords& out) {
  const bool enabled = now.enabled() && now.in_op != InOp::kNo;
  const std::optional<std::int8_t> mode = now.mode();
  const bool begins = enabled && (!enabled_ || mode != mode_) && now.state_before.has_value();
  const bool cyclic = mode == kCyclicPosition;
  const bool new_mode = begins && enabled_;
  enabled_ = enabled;
  mode_ = mode;
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (begins) {
    jump_.reset();
    step_count_ = 0;
    last_target_.reset();
    outlier_.reset();
    outside_from_ = {};
    echoes_ = 0;
    leads_ = false;
    repeats_ = {};
    const std::int64_t distance = cyclic && target && actual ? Apart(*actual, *target) : 0;
    if (Magnitude(distance) >= kLeastJump) {
      jump_ = Jump{now.Record(AxisFact::kJumpAtEnable, now.frame), distance, *target, *actual, *target, 0};
      jump_->record.quantity = Quantity::kPosition;
      jump_->record.new_mode = new_mode;
      jump_->record.lead = now.Lead();
    }
  }
  if (jump_) AtEnable(now, out);
  if (outlier_) AfterOutlier(now, out);
  if (spike_ && ++cycles_quiet_ > kQuietCycles) out.Add(*std::exchange(spike_, std::nullopt));
  if (enabled && cyclic && target) {
    Rhythm(now, out);
    TakeTarget(now);
  } else {
    last_target_.reset();
    step_count_ = 0;
    motion_ = {};
  }
  if (enabled && cyclic) {
    Echo(now, out);
    Limits(now, out);
    Alternates(now, out);
  } else if (now.state && mode) {
    returns_ = {};
  }
  actuals_ = {actual, actuals_[0], actuals_[1]};
}

void SetpointCheck::AtEnable(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (target) {
    jump_->largest_step = std::max(jump_->largest_step, Magnitude(Apart(jump_->last_target, *target)));
    jump_->last_target = *target;
  }
  // A master that runs to where the axis stands, or whose set point is that far ahead all the time.
  if (Magnitude(jump_->distance) < kTimesStep * jump_->largest_step) {
    jump_.reset();
    return;
  }
  const bool fault = IsFault(now.state) || now.Status(kErrorBit);
  const std::int64_t moved = actual ? Apart(jump_->actual, *actual) : 0;
  // Both may run on with their distance: the actual value has an offset (60B0h) or another reference.
  const std::int64_t left = target && actual ? Apart(*actual, *target) : jump_->distance;
  const bool nearer = Magnitude(left) * 5 <= Magnitude(jump_->distance) * 4;
  const bool runs =
      nearer && (moved > 0) == (jump_->distance > 0) && Magnitude(moved) * 5 >= Magnitude(jump_->distance);
  if (fault || runs) {
    AxisRecord record = jump_->record;
    record.frame = now.frame;
    record.fault = fault;
    record.a = jump_->target;
    record.b = jump_->actual;
    record.c = jump_->largest_step;
    out.Add(record);
    jump_.reset();
    return;
  }
  const FrameRef& since = jump_->record.since;
  const bool over = !since.has_time || !now.frame.has_time || Elapsed(since.time, now.frame.time) > kReactionNs;
  if (over || !now.enabled()) jump_.reset();
}

/// A step that was far above the usual ones is reported once a fault follows it, and else forgotten after some time.
void SetpointCheck::AfterOutlier(const AxisView& now, AxisRecords& out) {
  const bool cyclic = enabled_ && mode_ == kCyclicPosition;
  const bool fault = IsFault(now.state) || (cyclic && now.Status(kErrorBit));
  // Of a jump right before the fault nothing shows whether it was one, or the begin of a fast motion.
  if (fault && (outlier_->c > 0 || cycles_after_ >= kCyclesAfter)) {
    AxisRecord record = *outlier_;
    record.frame = now.frame;
    record.fault = true;
    out.Add(record);
    outlier_.reset();
    return;
  }
  ++cycles_after_;
  if (outlier_->since.has_time && now.frame.has_time && Elapsed(outlier_->since.time, now.frame.time) > kReactionNs) {
    outlier_.reset();
  }
}

/// The step after an outlier takes it back: no motion is meant that way.
void SetpointCheck::Spike(const AxisView& now) {
  const AxisRecord& outlier = *outlier_;
  const std::int64_t far = Apart(outlier.a, outlier.b);
  const std::int64_t left = Apart(outlier.a, *now.Target(Quantity::kPosition));
  if (cycles_after_ > kSpikeCycles || Magnitude(left) * kReturnShare > Magnitude(far)) return;
  const bool asked = (outlier.control.value_or(0) & kEnableWord) == kEnableWord;
  if (!asked || !outlier.since.has_time || !now.frame.has_time) return;
  AxisRecord record = outlier;
  record.fact = AxisFact::kTargetSpike;
  record.frame = record.last = now.frame;
  record.lasted = Elapsed(outlier.since.time, now.frame.time);
  if (record.lasted > kSpikeNs) return;
  spike_ = record;
  cycles_quiet_ = 0;
}

/// The next target, in operation: a step far above the usual ones is an outlier.
void SetpointCheck::TakeTarget(const AxisView& now) {
  const auto& target = now.Target(Quantity::kPosition);
  if (last_target_ && *last_target_ != *target) {
    const std::int64_t step = Magnitude(Apart(*last_target_, *target));
    const std::size_t known = std::min(step_count_, steps_.size());
    const std::int64_t usual =
        known == 0 ? 0 : *std::max_element(steps_.begin(), steps_.begin() + static_cast<std::ptrdiff_t>(known));
    if (spike_ && step * 2 >= Magnitude(Apart(spike_->a, spike_->b))) spike_.reset();
    if (outlier_) Spike(now);
    if (outlier_ && step * kTimesLater > Magnitude(Apart(outlier_->a, outlier_->b))) outlier_.reset();
    const auto& actual = now.Actual(Quantity::kPosition);
    const bool to_actual = actual && StepsToActual(*last_target_, *target, *actual);
    if (!to_actual && step >= kLeastJump && step >= kTimesStep * std::max<std::int64_t>(usual, 1)) {
      outlier_ = now.Record(AxisFact::kJumpInOperation, now.frame);
      outlier_->quantity = Quantity::kPosition;
      outlier_->lead = now.Lead();
      outlier_->a = *last_target_;
      outlier_->b = *target;
      outlier_->c = usual;
      cycles_after_ = 0;
    }
    steps_[step_count_++ % steps_.size()] = step;
  }
  last_target_ = target;
}

/// A drive that takes a target in each cycle makes no way where none is new, and twice the way in the next cycle.
void SetpointCheck::Rhythm(const AxisView& now, AxisRecords& out) {
  if (!last_target_) return;
  const std::int64_t step = Apart(*last_target_, *now.Target(Quantity::kPosition));
  if (step == 0) {
    if (motion_.step != 0 && ++motion_.waited > kMostWaited) motion_.step = 0;
    return;
  }
  const std::uint32_t waited = std::exchange(motion_.waited, 0U);
  const std::int64_t before = std::exchange(motion_.step, Magnitude(step) >= kLeastStep ? step : 0);
  if (before == 0 || motion_.step == 0 || (before > 0) != (step > 0)) return;
  ++motion_.steps;
  if (waited == 0) {
    ++motion_.prompt;
    return;
  }
  if (motion_.waits++ == 0) motion_.first = now.frame;
  motion_.cycles += waited;
  motion_.longest = std::max(motion_.longest, waited);
  if (Magnitude(step) * 2 >= Magnitude(before) * 3) ++motion_.made_up;
  ReportRhythm(now, out);
}

void SetpointCheck::ReportRhythm(const AxisView& now, AxisRecords& out) {
  const Motion& motion = motion_;
  if (motion.waits < kWaits) return;
  const bool slow = motion.prompt * kPromptOneIn <= motion.steps;
  const std::uint64_t all = motion.steps + motion.cycles;
  const bool uneven = !slow && motion.made_up * 2 >= motion.waits && motion.cycles * kWaitsOneIn >= all;
  if (!slow && !uneven) return;
  const AxisFact fact = slow ? AxisFact::kTargetSlow : AxisFact::kTargetUneven;
  AxisRecord* known = out.Find(fact);
  if (known == nullptr) {
    // One that is uneven first may turn out to be slow, and the other way round: the first one counts.
    if (motion_.told || !motion.first.has_time || !now.frame.has_time) return;
    motion_.told = true;
    AxisRecord record = now.Record(fact, motion.first);
    record.quantity = Quantity::kPosition;
    record.healthy = slow;
    record.inferred = true;
    out.Add(record);
    known = out.Find(fact);
  }
  known->last = now.frame;
  known->lasted = Elapsed(known->since.time, now.frame.time);
  known->a = static_cast<std::int64_t>(all);
  known->b = static_cast<std::int64_t>(motion.cycles);
  known->c = slow ? std::int64_t{motion.longest} + 1 : static_cast<std::int64_t>(motion.made_up);
}

/// The target is what the actual value was a cycle or two before: whatever pulls at the axis moves it.
void SetpointCheck::Echo(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!target || !actual) return;
  const bool is_echo = actuals_[1] == target || actuals_[0] == target;
  const bool ahead = actual == target;
  const bool leads = Leads(*target);
  if (!is_echo) {
    echoes_ = 0;
    leads_ = echo_told_ = false;
  } else {
    leads_ = leads_ || leads;
    if (actuals_[0] != actual && !ahead && echoes_++ == 0) {
      echo_from_ = *actual;
      echo_since_ = now.frame;
    }
  }
  const std::int64_t travelled = Magnitude(Apart(echo_from_, *actual));
  if (echo_told_ || echoes_ < kEchoes || !leads_ || travelled < static_cast<std::int64_t>(kEchoes) ||
      !echo_since_.has_time || !now.frame.has_time || Elapsed(echo_since_.time, now.frame.time) < kEchoNs) {
    return;
  }
  echo_told_ = true;
  AxisRecord record = now.Record(AxisFact::kTargetEchoes, echo_since_, Elapsed(echo_since_.time, now.frame.time));
  record.quantity = Quantity::kPosition;
  record.a = static_cast<std::int64_t>(echoes_);
  record.b = travelled;
  // An axis that is moved by hand is moved this way on purpose.
  record.inferred = true;
  out.Add(record);
}

/// Whether the actual value changed its speed, and the target did so after it.
bool SetpointCheck::Leads(std::int64_t target) {
  bool leads = false;
  for (std::size_t at = 0; at < repeats_.size(); ++at) {
    Repeats& repeats = repeats_[at];
    if (actuals_[at] != target) {
      repeats = {};
      continue;
    }
    if (++repeats.values == 1) continue;
    const std::int64_t step = Apart(*actuals_[at + 1], *actuals_[at]);
    repeats.least = repeats.values == 2 ? step : std::min(repeats.least, step);
    repeats.most = repeats.values == 2 ? step : std::max(repeats.most, step);
    leads = leads || repeats.most - repeats.least >= kOtherSpeed;
  }
  return leads;
}

/// Two parts of a program send process data: the target goes to a far value and back, again and again, and the axis
/// follows neither.
void SetpointCheck::Alternates(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!target || !actual || returns_.target == target) return;
  const std::optional<std::int64_t> before = returns_.target;
  returns_.target = target;
  if (!before) return;
  const std::int64_t step = Apart(*before, *target);
  const std::int64_t far = Magnitude(returns_.step);
  const bool opposite = returns_.step != 0 && (step > 0) != (returns_.step > 0);
  const bool back = opposite && Magnitude(Magnitude(step) - far) <= far / kReturnShare;
  const bool still = returns_.actual && Magnitude(Apart(*returns_.actual, *actual)) <= far / kReturnShare;
  returns_.step = Magnitude(step) >= kLeastJump ? step : 0;
  returns_.actual = actual;
  if (!back || !still) return;
  const bool paused =
      !returns_.last.has_time || !now.frame.has_time || Elapsed(returns_.last.time, now.frame.time) > kReactionNs;
  if (paused) {
    returns_.count = 0;
    returns_.told = false;
  }
  if (returns_.count++ == 0) returns_.first = now.frame;
  returns_.last = now.frame;
  if (returns_.count < kReturns || !returns_.first.has_time || !now.frame.has_time) return;
  const TimeNs lasted = Elapsed(returns_.first.time, now.frame.time);
  if (lasted < kEchoNs / 2) return;
  if (returns_.told) return out.Extend(AxisFact::kTargetAlternates, Quantity::kPosition, now.frame);
  returns_.told = true;
  AxisRecord record = now.Record(AxisFact::kTargetAlternates, returns_.first, lasted);
  record.quantity = Quantity::kPosition;
  record.a = *before;
  record.b = *target;
  record.c = static_cast<std::int64_t>(returns_.count);
  out.Add(record);
}

void SetpointCheck::Limits(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  const auto& [least, most] = now.limits;
  // Both 0, or the wrong way round: switched off. Where only one is in the capture, it counts if it is not 0.
  const bool both = least && most;
  const bool used = target && (both ? *least < *most : (least ? least : most).value_or(0) != 0);
  const bool below = used && least && *target < *least;
  const bool outside = below || (used && most && *target > *most);
  const TimeNs held = outside_.Hold(outside, now.frame);
  const std::int64_t limit = below ? least.value_or(0) : most.value_or(0);
  const auto beyond = [&](const std::optional<std::int64_t>& value) {
    if (!value) return std::int64_t{0};
    return below ? Bounded(limit) - Bounded(*value) : Bounded(*value) - Bounded(limit);
  };
  if (!outside || !outside_from_.target) {
    outside_from_ = {target, outside && beyond(actual) > 0 ? actual : std::nullopt};
  }
  // An axis that rests at its end is some increments beyond it now and then. One that was outside before the target
  // asked for a motion may rest there.
  const bool stood = outside_from_.actual && target;
  const bool asked = !stood || Magnitude(Apart(*outside_from_.target, *target)) >= kLeastJump;
  const bool far = outside && asked && beyond(target) >= kLeastJump;
  if (far && out.IsDue(AxisFact::kOutsideLimits, outside_, held, kOutsideNs, now.frame, Quantity::kPosition)) {
    AxisRecord record = now.Record(AxisFact::kOutsideLimits, outside_.since(), held);
    record.quantity = Quantity::kPosition;
    record.a = *target;
    record.b = limit;
    record.c = actual.value_or(0);
    record.healthy = !actual;
    out.Add(record);
  }
  if (!outside || !actual) return;
  AxisRecord* const reported = out.Find(AxisFact::kOutsideLimits);
  if (reported == nullptr || reported->followed) return;
  const std::int64_t way = stood ? Apart(*outside_from_.actual, *actual) : beyond(actual);
  const std::int64_t goal = stood ? Apart(*outside_from_.target, *target) : beyond(target);
  if (beyond(actual) <= 0 || way == 0 || Magnitude(way) * 2 < Magnitude(goal)) return;
  // The limits are not in use, or in another unit.
  reported->followed = reported->healthy = true;
  reported->c = *actual;
}

}  // namespace ecaudit::progress
