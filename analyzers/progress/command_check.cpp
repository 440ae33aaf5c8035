#include "analyzers/progress/command_check.h"

#include <algorithm>

namespace ecaudit::progress {
namespace {

constexpr TimeNs kStartNs = 1'000'000'000;
constexpr TimeNs kHomingNs = 2'000'000'000;
constexpr TimeNs kAcknowledgeNs = 500'000'000;
constexpr TimeNs kModeNs = 1'000'000'000;
/// A set point that changes more often moves; less often it may be a value that is prepared.
constexpr std::uint64_t kMoves = 20;

bool NeedsStart(std::int8_t mode) {
  return mode == kProfilePosition || mode == kHoming || mode == kInterpolated;
}

bool HasHalt(std::int8_t mode) {
  return mode == kProfilePosition || mode == kProfileVelocity || mode == kProfileTorque || mode == kHoming;
}

/// Such a set point has to come in each cycle: it is not written once by SDO.
bool IsCyclic(std::int8_t mode) {
  return mode == kInterpolated || mode == kCyclicPosition || mode == kCyclicVelocity || mode == kCyclicTorque;
}

bool IsVelocity(Quantity quantity) {
  return quantity == Quantity::kVelocity || quantity == Quantity::kSpeed;
}

constexpr std::array kQuantities{Quantity::kPosition, Quantity::kVelocity, Quantity::kTorque, Quantity::kSpeed};

/// The object of CiA 402 that holds the set point.
std::int64_t ObjectOf(Quantity quantity) {
  switch (quantity) {
    case Quantity::kPosition:
      return 0x607A;
    case Quantity::kVelocity:
      return 0x60FF;
    case Quantity::kSpeed:
      return 0x6042;
    default:
      return 0x6071;
  }
}

}  // namespace

void CommandCheck::Forget() {
  const CommandCheck before = *this;
  *this = {};
  commanded_ = before.commanded_;
  last_commanded_ = before.last_commanded_;
  wanted_ = before.wanted_;
  without_setpoint_ = before.without_setpoint_;
  all_starts_ = before.all_starts_;
}

bool CommandCheck::settled() const {
  if (enabled_ && !mode_) return goes_;
  // The velocity mode waits for an actual value that is 0.
  if (!enabled_ || !commanded_.seen() || NeedsStart(*mode_) || *mode_ == kVelocityMode) return false;
  const Quantity quantity = QuantityOf(*mode_);
  return quantity != Quantity::kNone && Of(quantity).changes >= kMoves;
}

void CommandCheck::BeginEnabled() {
  for (Setpoint& setpoint : setpoints_) {
    setpoint.changes = 0;
    setpoint.changed = setpoint.first_changed = {};
  }
  starts_ = 0;
  last_start_ = {};
  waits_acknowledge_ = false;
  ramp_seen_ = false;
  target_from_.reset();
  actual_from_.reset();
  start_missing_.Reset();
  start_stands_.Reset();
  halt_.Reset();
  ramp_bits_.Reset();
  no_mode_.Reset();
  not_mapped_.Reset();
}

void CommandCheck::FollowSetpoints(const AxisView& now) {
  for (const Quantity quantity : kQuantities) {
    Setpoint& setpoint = setpoints_[static_cast<std::size_t>(quantity) - 1];
    const std::optional<std::int64_t>& value = now.Target(quantity);
    if (!value) continue;
    const bool changed = setpoint.last && *setpoint.last != *value;
    setpoint.last = value;
    if (!changed || !enabled_ || (quantity == Quantity::kPosition && IsCopy(now, *value))) continue;
    ++setpoint.changes;
    setpoint.changed = now.frame;
    if (!setpoint.first_changed.seen()) setpoint.first_changed = now.frame;
  }
  if (!target_from_) target_from_ = now.Target(Quantity::kPosition);
  if (!actual_from_) actual_from_ = now.Actual(Quantity::kPosition);
  FollowPosition(now);
}

void CommandCheck::FollowPosition(const AxisView& now) {
  const auto& position = now.Actual(Quantity::kPosition);
  if (!position || position == positions_[0]) return;
  positions_ = {position, positions_[0], positions_[1]};
}

void CommandCheck::GoesOn(const AxisView& now) {
  for (std::size_t i = 0; i < setpoints_.size(); ++i) {
    if (now.target[i]) setpoints_[i].last = now.target[i];
  }
  FollowPosition(now);
  if (goes_) last_commanded_ = now.frame;
}

/// A master that copies the actual value into the target keeps the axis from a jump at the next start.
bool CommandCheck::IsCopy(const AxisView& now, std::int64_t target) const {
  if (std::find(positions_.begin(), positions_.end(), target) != positions_.end()) return true;
  // A drive that may follow at once shows the target in the same cycle.
  return now.Actual(Quantity::kPosition) == target && !(mode_ && IsCyclic(*mode_));
}

void CommandCheck::Step(const AxisView& now, AxisRecords& out) {
  const bool enabled = now.enabled() && now.in_op != InOp::kNo;
  const std::optional<std::int8_t> mode = now.mode();
  if (enabled != enabled_ || mode != mode_) {
    if (enabled && !enabled_) {
      enabling_seen_ = now.state_changed && now.state_before.has_value();
      never_without_halt_ = true;
    }
    enabled_ = enabled;
    mode_ = mode;
    BeginEnabled();
  }
  FollowSetpoints(now);
  if (mode_ || active()) Mode(now, out);
  goes_ = false;
  if (!enabled_) return;
  if (!mode_) {
    if (const Quantity moving = Moving(); moving != Quantity::kNone) Goes(Of(moving).first_changed, now.frame);
    return;
  }
  if (!now.Control(kHaltBit)) never_without_halt_ = false;
  const Quantity quantity = QuantityOf(*mode_);
  if (NeedsStart(*mode_)) Start(now, *mode_, out);
  const bool moves = quantity != Quantity::kNone && Of(quantity).changes > 0;
  if (moves || starts_ > 0) wanted_ = true;
  const bool started =
      NeedsStart(*mode_) ? starts_ > 0 || (*mode_ == kInterpolated && moves && now.Control(now.StartBit())) : moves;
  if (started && !(HasHalt(*mode_) && now.Control(kHaltBit))) Goes(now.frame, now.frame);
  if (*mode_ == kVelocityMode) RampBits(now, out);
  if (HasHalt(*mode_)) Halt(now, *mode_, out);
  if (quantity != Quantity::kNone && !now.Target(quantity)) without_setpoint_ = true;
}

void CommandCheck::Goes(const FrameRef& since, const FrameRef& frame) {
  goes_ = wanted_ = true;
  if (!commanded_.seen()) commanded_ = since;
  last_commanded_ = frame;
}

/// The set point that goes on, in whatever mode.
Quantity CommandCheck::Moving() const {
  Quantity moving = Quantity::kNone;
  for (const Quantity quantity : kQuantities) {
    if (Of(quantity).changes >= kMoves) moving = quantity;
  }
  return moving;
}

void CommandCheck::Start(const AxisView& now, std::int8_t mode, AxisRecords& out) {
  // The word that enables may start as well.
  if (now.Rises(now.StartBit()) ||
      (now.state_changed && now.Control(now.StartBit()) && enabling_seen_ && starts_ == 0 &&
       now.control_since.number > 0 && (now.control_before >> now.StartBit() & 1U) == 0)) {
    ++starts_;
    ++all_starts_;
    last_start_ = now.frame;
    out.Drop(AxisFact::kStartMissing);
    out.Drop(AxisFact::kStartStands);
    waits_acknowledge_ = mode == kProfilePosition;
    acknowledged_before_ = now.Status(kAcknowledgeBit);
  }
  const bool homing = mode == kHoming;
  const Setpoint& position = Of(Quantity::kPosition);
  const bool moves = mode == kInterpolated ? position.changes >= kMoves : position.changes > 0;
  const bool wants = homing ? now.mode_seen_to_change || enabling_seen_ : moves && enabling_seen_;
  // Drives are known that interpolate without the bit.
  const bool goes = mode == kInterpolated && !Stands(now);
  if (goes) out.Drop(AxisFact::kStartMissing);
  const TimeNs limit = homing ? kHomingNs : kStartNs;

  const bool missing = wants && !goes && starts_ == 0 && all_starts_ == 0 && !now.Control(now.StartBit());
  if (const TimeNs held = start_missing_.Hold(missing, now.frame);
      out.IsDue(AxisFact::kStartMissing, start_missing_, held, limit, now.frame)) {
    wanted_ = wanted_ || !homing;
    AxisRecord record = now.Record(AxisFact::kStartMissing, start_missing_.since(), held);
    record.a = mode;
    record.healthy = homing;
    out.Add(record);
  }
  // Interpolation goes on as long as the bit is set. A set point that came after the edge needs another one; while the
  // axis moves, the next one is only prepared.
  const bool behind = position.changed.number > last_start_.number;
  const bool stands = mode != kInterpolated && now.Control(now.StartBit()) && enabling_seen_ &&
                      (homing ? starts_ == 0 && now.mode_seen_to_change : moves && behind && now.Status(kReachedBit));
  if (const TimeNs held = start_stands_.Hold(stands, now.frame);
      out.IsDue(AxisFact::kStartStands, start_stands_, held, limit, now.frame)) {
    wanted_ = wanted_ || !homing;
    AxisRecord record = now.Record(AxisFact::kStartStands, start_stands_.since(), held);
    record.a = mode;
    record.healthy = homing;
    out.Add(record);
  }
  if (mode == kProfilePosition) Handshake(now, out);
}

/// The actual value is known, and did not go where the target went.
bool CommandCheck::Stands(const AxisView& now) const {
  constexpr std::int64_t kShare = 20;
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!target || !actual || !target_from_ || !actual_from_) return false;
  return Magnitude(Apart(*actual_from_, *actual)) * kShare < Magnitude(Apart(*target_from_, *target));
}

/// The actual value is known, and nothing of what the set point asks for happens.
bool CommandCheck::Rests(const AxisView& now, Quantity moving) const {
  if (moving == Quantity::kPosition) return Stands(now);
  return IsVelocity(moving) && now.Target(moving).value_or(0) != 0 && now.Actual(moving) == 0;
}

/// Bit 12 answers each edge of bit 4.
void CommandCheck::Handshake(const AxisView& now, AxisRecords& out) {
  if (now.Status(kAcknowledgeBit) && !acknowledged_before_) waits_acknowledge_ = false;
  if (!now.Status(kAcknowledgeBit)) acknowledged_before_ = false;
  const bool waits = waits_acknowledge_ && !now.Status(kAcknowledgeBit);
  if (const TimeNs held = unacknowledged_.Hold(waits, now.frame);
      out.IsDue(AxisFact::kNotAcknowledged, unacknowledged_, held, kAcknowledgeNs, now.frame)) {
    out.Add(now.Record(AxisFact::kNotAcknowledged, last_start_, held));
  }
}

/// Bits 4 to 6 of the velocity mode let the ramp run, unlock it and use the reference. A master that stops the axis by
/// them leaves the reference as it is.
void CommandCheck::RampBits(const AxisView& now, AxisRecords& out) {
  if ((now.control.value_or(0) & (kRampBits | kEnableWord)) == (kRampBits | kEnableWord)) {
    ramp_seen_ = true;
    out.Drop(AxisFact::kRampBits);
  }
  const auto& target = now.Target(Quantity::kSpeed);
  // In whatever unit.
  const auto& speed = now.Actual(Quantity::kSpeed) ? now.Actual(Quantity::kSpeed) : now.Actual(Quantity::kVelocity);
  const bool wants = Of(Quantity::kSpeed).changes > 0 && enabling_seen_ && target.value_or(0) != 0;
  const bool missing = wants && speed == 0 && now.control && !ramp_seen_;
  if (const TimeNs held = ramp_bits_.Hold(missing, now.frame);
      out.IsDue(AxisFact::kRampBits, ramp_bits_, held, kStartNs, now.frame)) {
    wanted_ = true;
    AxisRecord record = now.Record(AxisFact::kRampBits, ramp_bits_.since(), held);
    record.a = *target;
    out.Add(record);
  }
}

/// A halt that was taken away before is used: a hold of the motion is wanted then. So it is with one that is taken away
/// later.
void CommandCheck::Halt(const AxisView& now, std::int8_t mode, AxisRecords& out) {
  if (!now.Control(kHaltBit) && (now.control.value_or(0) & kEnableWord) == kEnableWord) {
    out.Drop(AxisFact::kHaltStands);
  }
  const Quantity quantity = QuantityOf(mode);
  const bool wants = starts_ > 0 || (quantity != Quantity::kNone && Of(quantity).changes > 0);
  const bool stands = now.Control(kHaltBit) && never_without_halt_ && enabling_seen_ && wants;
  if (const TimeNs held = halt_.Hold(stands, now.frame);
      out.IsDue(AxisFact::kHaltStands, halt_, held, kStartNs, now.frame)) {
    wanted_ = true;
    AxisRecord record = now.Record(AxisFact::kHaltStands, halt_.since(), held);
    record.a = mode;
    out.Add(record);
  }
}

void CommandCheck::Mode(const AxisView& now, AxisRecords& out) {
  // A drive may leave a mapped 0 aside: only what it shows proves that it does not.
  const bool overwritten = now.in_op == InOp::kYes && now.mode_mapped == 0 && now.mode_by_sdo.value_or(0) != 0 &&
                           now.mode_shown && now.mode_shown != now.mode_by_sdo;
  if (const TimeNs held = overwritten_.Hold(overwritten, now.frame);
      out.IsDue(AxisFact::kOverwrittenMode, overwritten_, held, kModeNs, now.frame)) {
    AxisRecord record = now.Record(AxisFact::kOverwrittenMode, overwritten_.since(), held);
    record.a = *now.mode_by_sdo;
    record.b = *now.mode_mapped;
    record.c = *now.mode_shown;
    out.Add(record);
  }
  const Quantity moving = Moving();
  const bool known = enabled_ && now.in_op == InOp::kYes && moving != Quantity::kNone;
  // A drive may keep its mode when 0 is written: without 6061h only the actual value shows that it has none.
  const bool none_shown = now.mode_shown == 0 && now.mode_by_sdo.value_or(0) == 0;
  const bool none_written = !now.mode_shown && now.mode_by_sdo == 0 && Rests(now, moving);
  const bool unselected = known && now.mode_mapped.value_or(0) == 0 && now.began && (none_shown || none_written);
  if (const TimeNs held = no_mode_.Hold(unselected, now.frame);
      out.IsDue(AxisFact::kNoMode, no_mode_, held, kModeNs, now.frame, moving)) {
    wanted_ = true;
    AxisRecord record = now.Record(AxisFact::kNoMode, no_mode_.since(), held);
    record.by_sdo = record.inferred = none_written;
    record.quantity = moving;
    record.c = ObjectOf(moving);
    out.Add(record);
  }
  const Quantity needed = mode_ ? QuantityOf(*mode_) : Quantity::kNone;
  // A target velocity beside a position that stays is meant for a velocity mode; echoes of actual values are not meant.
  const auto asked = now.mode_asked();
  const bool mode_taken = asked.value_or(0) == 0 || asked == mode_;  // else drive-mode-not-shown reports it
  const bool unused = mode_taken && mode_ == kCyclicPosition && moving == Quantity::kVelocity &&
                      Of(Quantity::kPosition).changes == 0 && now.Target(moving).value_or(0) != 0;
  const bool other = needed != moving && !(IsVelocity(needed) && IsVelocity(moving));
  const bool elsewhere = known && needed != Quantity::kNone && other && (!now.Target(needed) || unused);
  if (const TimeNs held = not_mapped_.Hold(elsewhere, now.frame);
      out.IsDue(AxisFact::kSetpointNotMapped, not_mapped_, held, kModeNs, now.frame, needed)) {
    wanted_ = true;
    AxisRecord record = now.Record(AxisFact::kSetpointNotMapped, not_mapped_.since(), held);
    record.quantity = needed;
    record.a = *mode_;
    record.b = ObjectOf(needed);
    record.c = ObjectOf(moving);
    record.constant = now.Target(needed).has_value();
    // The drive may keep a set point that an SDO wrote before the capture.
    record.inferred = !record.constant && !IsCyclic(*mode_);
    out.Add(record);
  }
}

}  // namespace ecaudit::progress
