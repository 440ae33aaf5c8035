#include "analyzers/progress/follow_check.h"

#include <algorithm>

namespace ecaudit::progress {
namespace {

constexpr TimeNs kErrorNs = 20'000'000;
constexpr TimeNs kStillNs = 500'000'000;
constexpr TimeNs kRestNs = 200'000'000;
/// Brakes release, and some methods wait for a signal.
constexpr TimeNs kHomingStillNs = 3'000'000'000;
constexpr std::int64_t kLeastOfHoming = 5;
constexpr TimeNs kStoppedNs = 50'000'000;
/// A search of the reference that is longer may find no switch.
constexpr TimeNs kLongSearchNs = 10'000'000'000;
constexpr TimeNs kMovesNs = 1'000'000'000;
/// In coarse units an axis that moves shows few steps, all of them one way; one that rests goes back and forth.
constexpr std::uint32_t kLeastSteps = 2;
constexpr TimeNs kRampNs = 1'000'000'000;
/// Below, an axis need not move: friction, and units that are smaller than what it can resolve.
constexpr std::int64_t kLeastTravel = 500;
constexpr std::int64_t kShare = 20;
/// What an axis moves in the time of a limit when it moves at all: a share of its way or speed, and more than jitter.
constexpr std::int64_t kShareOfSlow = 2000;
constexpr std::int64_t kLeastSlow = 2;

/// In thousandths of the rated torque: less may be friction that is compensated.
constexpr std::int64_t kLeastTorque = 50;

/// Below, a velocity may be noise in any unit.
constexpr std::int64_t kLeastVelocity = 10;

constexpr std::int64_t LeastMotion(std::int64_t whole) {
  return std::max(kLeastSlow, Magnitude(whole) / kShareOfSlow);
}

/// The limit switch (60FDh) that is active where the axis is to go.
std::uint8_t SwitchAhead(const AxisView& now, std::int64_t way) {
  return static_cast<std::uint8_t>(now.switches & (way < 0 ? kNegativeSwitch : kPositiveSwitch));
}

/// Bit 13 of the status word; in the other modes it is reserved or of another meaning.
bool HasFollowingError(std::int8_t mode) {
  return mode == kProfilePosition || mode == kCyclicPosition;
}

}  // namespace

void FollowCheck::Forget() {
  const FollowCheck before = *this;
  *this = {};
  follows_ = before.follows_;
  followed_ = before.followed_;
}

void FollowCheck::Follows(const FrameRef& frame) {
  if (!follows_.seen()) follows_ = frame;
  followed_ = frame;
}

void FollowCheck::Step(const AxisView& now, AxisRecords& out) {
  const bool enabled = now.enabled() && now.in_op != InOp::kNo;
  const std::optional<std::int8_t> mode = now.mode();
  if (enabled != enabled_ || mode != mode_) {
    if (search_ && enabled && enabled_ && mode) HomingLeft(now, out);
    if (search_) out.Drop(AxisFact::kHomingRuns);
    search_.reset();
    restart_ = true;
    still_.Reset();
    wrong_way_.Reset();
    slow_.Reset();
    rest_.Reset();
    approach_.Reset();
    started_ = stood_ = false;
  }
  enabled_ = enabled;
  mode_ = mode;
  if (!enabled_ || !mode_) {
    error_.Reset();
    return;
  }
  Bits(now, out);
  switch (*mode_) {
    case kCyclicPosition:
    case kInterpolated:
      Position(now, out);
      return;
    case kProfilePosition:
      Profile(now, out);
      return;
    case kCyclicVelocity:
    case kProfileVelocity:
    case kVelocityMode:
      Velocity(now, out);
      return;
    case kProfileTorque:
    case kCyclicTorque:
      Torque(now, out);
      return;
    case kHoming:
      Homing(now, out);
      return;
    default:
      return;
  }
}

/// The drive searches its reference by itself once bit 4 has risen. A family that starts it by another bit shows its
/// end by other bits as well.
void FollowCheck::Homing(const AxisView& now, AxisRecords& out) {
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!actual || now.StartBit() != kStartBit) return;
  if (now.Rises(kStartBit)) {
    begin_.actual = *actual;
    started_ = true;
    steps_ = {};
    still_.Reset();
    search_ = Search{now.frame, {}, false};
  }
  if (search_ && steps_.last && *steps_.last != *actual) search_->moved = now.frame;
  steps_.Step(*actual);
  const std::int64_t moved = Apart(begin_.actual, *actual);
  if (now.Status(kAcknowledgeBit) && !now.Status(kErrorBit)) {
    followed_ = now.frame;
    // It was slow, or waited for a brake.
    if (stood_) out.Heal(AxisFact::kHomingStands, Quantity::kNone, now.frame);
    stood_ = false;
  }
  if (search_) {
    const bool attained = now.Status(kAcknowledgeBit) && search_->open;
    if (attained || now.Status(kErrorBit) || now.Control(kHaltBit)) {
      search_.reset();
      out.Drop(AxisFact::kHomingRuns);
    } else if (now.status && !now.Status(kAcknowledgeBit)) {
      search_->open = true;
    }
  }
  HomingRuns(now, moved, out);
  if (Magnitude(moved) > kLeastOfHoming || now.Status(kAcknowledgeBit)) started_ = false;
  const bool still = started_ && now.Control(kStartBit) && !now.Control(kHaltBit) && !now.Status(kErrorBit);
  const TimeNs held = still_.Hold(still, now.frame);
  if (held >= kHomingStillNs && steps_.one_way && steps_.count >= kLeastSteps) {
    started_ = false;  // it moves
    return;
  }
  if (out.IsDue(AxisFact::kHomingStands, still_, held, kHomingStillNs, now.frame)) {
    stood_ = true;
    AxisRecord record = now.Record(AxisFact::kHomingStands, still_.since(), held);
    record.b = moved;
    record.c = now.zero_limit;
    record.by_sdo = now.zero_by_sdo;
    out.Add(record);
  }
}

/// The drive goes on to search its reference. How long that may take, nothing shows.
void FollowCheck::HomingRuns(const AxisView& now, std::int64_t moved, AxisRecords& out) {
  const bool moves = search_ && search_->open && steps_.count >= kLeastSteps && search_->moved.has_time &&
                     now.frame.has_time && Elapsed(search_->moved.time, now.frame.time) <= kMovesNs;
  const TimeNs held = runs_.Hold(moves, now.frame);
  if (!out.IsDue(AxisFact::kHomingRuns, runs_, held, kLongSearchNs, now.frame)) return;
  AxisRecord record = now.Record(AxisFact::kHomingRuns, search_->since, held);
  record.b = moved;
  record.healthy = true;
  out.Add(record);
}

/// The master selects another mode while the drive searches its reference. One that was stopped before is at rest.
void FollowCheck::HomingLeft(const AxisView& now, AxisRecords& out) const {
  if (!search_->open || !search_->moved.seen() || !search_->moved.has_time || !now.frame.has_time) return;
  if (Elapsed(search_->moved.time, now.frame.time) > kStoppedNs || steps_.count < kLeastSteps) return;
  const std::int64_t moved = Apart(begin_.actual, *steps_.last);
  if (Magnitude(moved) <= kLeastOfHoming || !search_->since.has_time) return;
  AxisRecord record = now.Record(AxisFact::kHomingCut, search_->since, Elapsed(search_->since.time, now.frame.time));
  record.b = moved;
  out.Add(record);
}

void FollowCheck::Bits(const AxisView& now, AxisRecords& out) {
  if (now.error_bit_differs) return;
  const bool homing = *mode_ == kHoming;
  const AxisFact fact = homing ? AxisFact::kHomingError : AxisFact::kFollowingError;
  const bool error = (homing || HasFollowingError(*mode_)) && now.Status(kErrorBit);
  if (error && !error_.active()) error_lead_ = now.Lead();
  if (const TimeNs held = error_.Hold(error, now.frame); out.IsDue(fact, error_, held, kErrorNs, now.frame)) {
    AxisRecord record = now.Record(fact, error_.since(), held);
    record.lead = error_lead_;
    if (now.Target(Quantity::kPosition)) record.a = *now.Target(Quantity::kPosition);
    if (now.Actual(Quantity::kPosition)) record.b = *now.Actual(Quantity::kPosition);
    out.Add(record);
  }
}

void FollowCheck::Position(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!target || !actual) return;
  if (restart_) {
    restart_ = false;
    together_ = slow_from_ = begin_ = {*target, *actual};
    last_target_ = *target;
  }
  // A master takes the mode over with the target that it had before, and copies the actual value a cycle later.
  if (Magnitude(Apart(last_target_, *target)) >= kLeastTravel && StepsToActual(last_target_, *target, *actual)) {
    together_ = slow_from_ = begin_ = {*target, *actual};
  }
  last_target_ = *target;
  const Way way = WayFrom(together_, *target, *actual);
  const bool far = Magnitude(way.target) >= kLeastTravel;
  const bool still = far && Magnitude(way.actual) * kShare < Magnitude(way.target);
  const bool wrong =
      far && way.actual != 0 && !way.SameDirection() && Magnitude(way.actual) * 2 > Magnitude(way.target);
  Report(AxisFact::kStandsStill, still_, still, kStillNs, way, now, out);
  Report(AxisFact::kWrongWay, wrong_way_, wrong, kStillNs, way, now, out);
  const bool moves = Magnitude(way.actual) * kShare >= Magnitude(way.target);
  if (moves && (way.target == 0 || way.SameDirection())) together_ = {*target, *actual};

  const Way slow = WayFrom(slow_from_, *target, *actual);
  const bool half = Magnitude(slow.actual) * 2 >= Magnitude(slow.target);
  const bool behind = Magnitude(slow.target) >= kLeastTravel && !half && !still && !wrong && slow.SameDirection();
  Report(AxisFact::kLags, slow_, behind, kStillNs, slow, now, out);
  Rest(slow, behind, now, out);
  if (half || still || wrong) slow_from_ = {*target, *actual};

  const Way all = WayFrom(begin_, *target, *actual);
  if (Magnitude(all.target) >= 20 && all.SameDirection() && Magnitude(all.actual) * 2 > Magnitude(all.target)) {
    Follows(now.frame);
    begin_ = {*target, *actual};
  }
}

/// A drive that cannot follow goes on when its target rests.
void FollowCheck::Rest(const Way& way, bool behind, const AxisView& now, AxisRecords& out) {
  const Place here{*now.Target(Quantity::kPosition), *now.Actual(Quantity::kPosition)};
  if (here.target != rest_at_.target || Magnitude(Apart(rest_at_.actual, here.actual)) > kLeastSlow) {
    rest_at_ = here;
    rest_.Reset();
  }
  const bool rests = behind && !now.Status(kLimitBit) && !now.Status(kErrorBit);
  if (rest_.Hold(rests, now.frame) < kRestNs || !rest_.Report()) return;
  AxisRecord* const lags = out.Find(AxisFact::kLags);
  if (lags == nullptr) return;
  lags->rests = true;
  lags->a = way.target;
  lags->b = way.actual;
}

/// The drive makes the way, and takes the target by the edge of bit 4.
void FollowCheck::Profile(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!target || !actual) return;
  if (now.Rises(now.StartBit())) {
    const bool relative = now.Control(kRelativeBit);
    begin_ = {relative ? 0 : *actual, *actual};
    goal_ = *target;
    moved_from_ = *actual;
    started_ = true;
    stood_ = false;
    still_.Reset();
  }
  if (!started_) return;
  const Way way = WayFrom(begin_, goal_, *actual);
  if (Magnitude(Apart(moved_from_, *actual)) > LeastMotion(way.target)) {
    moved_from_ = *actual;
    still_.Reset();
  }
  const bool halted = now.Control(kHaltBit) || now.Status(kReachedBit);
  const bool still = Magnitude(way.target) >= kLeastTravel && Magnitude(way.actual) * kShare < Magnitude(way.target);
  const bool stands = Report(AxisFact::kStandsStill, still_, still && !halted, kRampNs, way, now, out);
  stood_ = stood_ || (stands && now.zero_limit == 0);
  if (way.target == 0 || !way.SameDirection() || Magnitude(way.actual) * 2 <= Magnitude(way.target)) return;
  Follows(now.frame);
  // It waited for a brake or a release, and then made the way of the same start.
  if (stood_) out.Heal(AxisFact::kStandsStill, Quantity::kPosition, now.frame);
  stood_ = false;
}

bool FollowCheck::Report(AxisFact fact, Lasting& lasting, bool holds, TimeNs limit, const Way& way, const AxisView& now,
                         AxisRecords& out) {
  const TimeNs held = lasting.Hold(holds, now.frame);
  if (!out.IsDue(fact, lasting, held, limit, now.frame, Quantity::kPosition)) return false;
  const bool stopped = now.zero_limit != 0 && fact == AxisFact::kStandsStill;
  AxisRecord record = now.Record(stopped ? AxisFact::kZeroLimit : fact, lasting.since(), held);
  record.quantity = Quantity::kPosition;
  record.c = now.zero_limit;
  record.by_sdo = now.zero_by_sdo;
  record.a = way.target;
  record.b = way.actual;
  record.limited = now.Status(kLimitBit);
  record.at_switch = SwitchAhead(now, way.target);
  out.Add(record);
  return true;
}

/// Without any torque an axis cannot move. An axis that turns freely at its speed limit needs none.
void FollowCheck::Torque(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kTorque);
  const auto& actual = now.Actual(Quantity::kTorque);
  const auto& position = now.Actual(Quantity::kPosition);
  if (!target || !actual) return;
  if (approach_.Step(*target, *actual, LeastMotion(*target))) slow_.Reset();
  const bool halted = *mode_ == kProfileTorque && now.Control(kHaltBit);
  const bool asked = Magnitude(*target) >= kLeastTorque && !halted;
  const bool without = asked && Magnitude(*actual) * kShare < Magnitude(*target);
  if (!slow_.active()) slow_window_ = {};
  if (without && !slow_window_.from) slow_window_.from = position;
  const TimeNs held = slow_.Hold(without && position, now.frame);
  if (slow_window_.from && position && Magnitude(Apart(*slow_window_.from, *position)) >= kLeastTravel) {
    slow_.Reset();
    return;
  }
  if (!out.IsDue(AxisFact::kStandsStill, slow_, held, kRampNs, now.frame, Quantity::kTorque)) return;
  AxisRecord record =
      now.Record(now.zero_limit != 0 ? AxisFact::kZeroLimit : AxisFact::kStandsStill, slow_.since(), held);
  record.quantity = Quantity::kTorque;
  record.a = *target;
  record.b = *actual;
  record.c = now.zero_limit;
  record.by_sdo = now.zero_by_sdo;
  record.limited = now.Status(kLimitBit);
  record.at_switch = SwitchAhead(now, *target);
  record.healthy = record.limited && now.zero_limit == 0;
  out.Add(record);
}

void FollowCheck::Slow::Step(std::int64_t target, std::int64_t actual, const std::optional<std::int64_t>& position,
                             const FrameRef& frame) {
  constexpr std::int64_t kShareOfNoise = 4;
  steps.Step(actual);
  keeps_sign = keeps_sign && Magnitude(actual) >= kLeastVelocity && (actual > 0) == (target > 0);
  if (!from) from = position;
  const std::int64_t noise = std::max(kLeastVelocity, Magnitude(level) / kShareOfNoise);
  if (level_since.seen() && Magnitude(Bounded(actual) - level) <= noise) return;
  level = Bounded(actual);
  level_since = frame;
}

bool FollowCheck::Slow::IsSteady(const FrameRef& frame) const {
  return Magnitude(level) >= kLeastVelocity && level_since.has_time && frame.has_time &&
         Elapsed(level_since.time, frame.time) >= kStillNs;
}

bool FollowCheck::Slow::Turns(const FrameRef& frame) const {
  // What only grows is a ramp: it is not over.
  return IsSteady(frame) || (keeps_sign && !steps.one_way);
}

/// A velocity mode has ramps, or the load has: what counts is a value that does not come nearer to its target.
void FollowCheck::Velocity(const AxisView& now, AxisRecords& out) {
  const Quantity quantity = QuantityOf(*mode_);
  const auto& target = now.Target(quantity);
  const auto& actual = now.Actual(quantity);
  if (!target || !actual) return;
  const bool halted = *mode_ != kCyclicVelocity && now.Control(kHaltBit);
  // The velocity mode is started and stopped by its bits, and the reference may stay.
  const bool ramp_stands = *mode_ == kVelocityMode && (now.control.value_or(0) & kRampBits) != kRampBits;
  const bool asked = Magnitude(*target) >= kLeastVelocity && !halted && !ramp_stands;
  if (approach_.Step(*target, *actual, LeastMotion(*target))) {
    slow_.Reset();
    wrong_way_.Reset();
  }
  const bool slow = asked && Magnitude(*actual) * kShare < Magnitude(*target);
  const auto& position = now.Actual(Quantity::kPosition);
  if (!slow_.active()) slow_window_ = {};
  if (slow) slow_window_.Step(*target, *actual, position, now.frame);
  if (stood_ && goal_ != *target) stood_ = false;
  if (asked && !slow && (*actual > 0) == (*target > 0)) {
    Follows(now.frame);
    // As in profile position. A cyclic set point goes on, and the axis does not catch up with it.
    if (stood_) out.Heal(AxisFact::kStandsStill, Quantity::kVelocity, now.frame);
    stood_ = false;
  }
  const auto record_of = [&](AxisFact fact, const Lasting& lasting, TimeNs held) {
    AxisRecord record = now.Record(fact, lasting.since(), held);
    record.quantity = Quantity::kVelocity;
    record.a = *target;
    record.b = *actual;
    record.limited = now.Status(kLimitBit);
    record.by_sdo = now.zero_by_sdo;
    record.at_switch = SwitchAhead(now, *target);
    return record;
  };
  const TimeNs slow_for = slow_.Hold(slow, now.frame);
  const bool turns = slow_window_.from && position && Magnitude(Apart(*slow_window_.from, *position)) >= kLeastTravel;
  const bool scaled = now.zero_limit == 0 && !position && slow_window_.Turns(now.frame);
  // A ramp in another unit goes one way, and noise around 0 does not.
  const bool ramps =
      now.zero_limit == 0 && !scaled && slow_window_.steps.one_way && Magnitude(*actual) >= kLeastVelocity;
  if (slow_for >= kRampNs && turns) {
    slow_.Reset();  // its velocity is in another unit, or below the resolution of 606Ch
  } else if (!ramps && out.IsDue(AxisFact::kStandsStill, slow_, slow_for, kRampNs, now.frame, Quantity::kVelocity)) {
    const bool stopped = now.zero_limit != 0;
    const AxisFact fact = stopped ? AxisFact::kZeroLimit : scaled ? AxisFact::kOtherScale : AxisFact::kStandsStill;
    AxisRecord record = record_of(fact, slow_, slow_for);
    record.c = now.zero_limit;
    record.inferred = scaled;
    // A winder or a clamp gets a velocity that its torque limit does not let it reach.
    record.healthy = (record.limited && !stopped) || scaled;
    out.Add(record);
    stood_ = *mode_ != kCyclicVelocity && fact == AxisFact::kStandsStill;
    goal_ = *target;
  }
  const bool wrong =
      asked && *actual != 0 && (*actual > 0) != (*target > 0) && Magnitude(*actual) * 2 > Magnitude(*target);
  if (const TimeNs held = wrong_way_.Hold(wrong, now.frame);
      out.IsDue(AxisFact::kWrongWay, wrong_way_, held, kRampNs, now.frame, Quantity::kVelocity)) {
    AxisRecord record = record_of(AxisFact::kWrongWay, wrong_way_, held);
    record.healthy = record.limited;  // the material pulls the axis
    out.Add(record);
  }
}

}  // namespace ecaudit::progress
