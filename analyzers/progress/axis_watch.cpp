#include "analyzers/progress/axis_watch.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace ecaudit::progress {
namespace {

using device::DriveState;

// In the order of Quantity.
constexpr std::array kTargets{Role::kTargetPosition, Role::kTargetVelocity, Role::kTargetTorque, Role::kTargetSpeed};
constexpr RoleSet kLimits{kLimitRoles};
constexpr std::array kActuals{Role::kPosition, Role::kVelocity, Role::kTorque, Role::kSpeed};
/// The process data must show the same 6061h for this long before the answer by SDO ...
constexpr TimeNs kSettledNs = 100'000'000;
/// ... and for this long after it.
constexpr TimeNs kStaysNs = 50'000'000;
/// Lost cycles in which nothing that lasts began or ended, if both words are what they were.
constexpr TimeNs kShortGapNs = 100'000'000;
/// How far back the values before a fault go.
constexpr TimeNs kLeadNs = 50'000'000;
constexpr TimeNs kLeadSteps = 5;
constexpr std::size_t kFaults = 16;
/// Of the status word: the state, voltage, warning and remote.
constexpr std::uint16_t kWayBits = 0x02FF;
static_assert(kTargets.size() == kQuantityCount && kActuals.size() == kQuantityCount);

}  // namespace

void AxisWatch::SetDrive(const device::DriveProfile* drive) {
  if (drive_ == drive) return;
  drive_ = drive;
  reserved_control_mask_ = level_mask_ = level_ = state_bits_ = status_bits_ = 0;
  state_known_ = false;
  now_.error_bit_differs = false;
  now_.homing_bit = kStartBit;
  if (drive == nullptr) return;
  state_bits_ = drive->StateBits();
  for (const device::WordBit& bit : drive->control_bits) {
    reserved_control_mask_ = static_cast<std::uint16_t>(reserved_control_mask_ | bit.reserved);
  }
  for (const device::OperationMode& mode : drive->modes) {
    if (mode.value == kHoming) now_.homing_bit = mode.start_bit.value_or(kStartBit);
  }
  for (const device::WordBit& bit : drive->status_bits) {
    if (bit.bit == kErrorBit && bit.sign != device::BitSign::kNone) now_.error_bit_differs = true;
    if (!bit.level) continue;
    level_mask_ = static_cast<std::uint16_t>(level_mask_ | 1U << bit.bit);
    if (*bit.level != 0) level_ = static_cast<std::uint16_t>(level_ | 1U << bit.bit);
  }
  status_bits_ = static_cast<std::uint16_t>(state_bits_ | level_mask_ | 1U << kVoltageBit);
}

void AxisWatch::NoteReserved(Reserved& reserved, std::uint16_t mask, std::uint16_t word, const FrameRef& frame) {
  if (reserved.bits == 0 && (word & mask) != 0)
    reserved = {static_cast<std::uint16_t>(word & mask), word, frame, std::nullopt};
}

/// Bits 4 to 6, in a mode that the drive shows and works in: before it may be another one. A control word may come in
/// one frame with another mode, which counts then.
void AxisWatch::NoteReservedOfMode(std::uint16_t word, const FrameRef& frame) {
  const bool works = now_.in_op == InOp::kYes && now_.enabled() && now_.mode_shown;
  if (drive_ == nullptr || reserved_control_.bits != 0 || !works) return;
  if (now_.mode_asked().value_or(*now_.mode_shown) != *now_.mode_shown) return;
  for (const device::ModeBits& row : drive_->mode_bits) {
    if (row.mode != *now_.mode_shown) continue;
    NoteReserved(reserved_control_, row.reserved, word, frame);
    if (reserved_control_.bits != 0) reserved_control_.mode = row.mode;
  }
}

inline void AxisWatch::Side(const SlaveSide& slave) {
  if (now_.side() == slave) return;
  words_changed_ = way_changed_ = true;
  now_.side() = slave;
}

AxisWatch::Checks& AxisWatch::GetChecks() {
  if (checks_ == nullptr) checks_ = std::make_unique<Checks>();
  return *checks_;
}

const AxisWatch::Checks& AxisWatch::OfChecks() const {
  static const Checks kNone;
  return checks_ != nullptr ? *checks_ : kNone;
}

inline AxisWatch::Look AxisWatch::LookAt(Newest& newest, std::uint64_t part, const FrameRef& frame) {
  if (frame.number == newest.frame && part != newest.part && collected_ == nullptr) {
    collected_ = std::make_unique<Collected>();
  }
  // Another part may have brought other values of the same objects.
  const bool all = newest.forgotten || part != newest.part;
  newest = {frame.number, part, false};
  if (collected_ != nullptr) return Look::kLater;
  return all ? Look::kAll : Look::kChanged;
}

bool AxisWatch::OnOutputs(const AxisValues& values, std::uint64_t part, const FrameRef& frame, const SlaveSide& slave) {
  if (newest_outputs_.IsLate(part, frame)) return false;
  if (const Look look = LookAt(newest_outputs_, part, frame); look != Look::kLater) {
    TakeOutputs(values, look, frame, slave);
    return true;
  }
  if (collected_->outputs_frame.seen() && collected_->outputs_frame.number != frame.number) TakeCollected();
  collected_->outputs.Merge(values);
  collected_->outputs_frame = frame;
  collected_->slave = slave;
  return true;
}

bool AxisWatch::OnInputs(const AxisValues& values, std::uint64_t part, const FrameRef& frame, const SlaveSide& slave) {
  if (newest_inputs_.IsLate(part, frame)) return false;
  if (const Look look = LookAt(newest_inputs_, part, frame); look != Look::kLater) {
    TakeInputs(values, look, frame, slave);
    return true;
  }
  if (collected_->inputs_frame.seen() && collected_->inputs_frame.number != frame.number) TakeCollected();
  collected_->inputs.Merge(values);
  collected_->inputs_frame = frame;
  collected_->slave = slave;
  return true;
}

[[gnu::noinline]] void AxisWatch::TakeCollected() {
  if (collected_ == nullptr) return;
  const Collected collected = std::exchange(*collected_, {});
  if (collected.outputs_frame.seen()) {
    TakeOutputs(collected.outputs, Look::kAll, collected.outputs_frame, collected.slave);
  }
  if (collected.inputs_frame.seen()) {
    TakeInputs(collected.inputs, Look::kAll, collected.inputs_frame, collected.slave);
  }
}

[[gnu::always_inline]] inline void AxisWatch::TakeOutputs(const AxisValues& values, Look look, const FrameRef& frame,
                                                          const SlaveSide& slave) {
  Side(slave);
  // What a word or a mode means depends on the others.
  const bool all = look == Look::kAll || words_changed_;
  if (all || values.changed()) {
    const RoleSet news = all ? values.mapped() : values.news();
    const std::optional<std::uint16_t> before = now_.control;
    const bool control = news.has(Role::kControl);
    if (control) {
      now_.control_mapped = true;
      TakeControl(*values[Role::kControl], frame);
    }
    if (terminal_ && !now_.mode_assumed) AssumeMode(values);
    if (all || terminal_ || values.changed(Role::kMode) || values.changed(Role::kModeShown)) TakeModes(values, frame);
    if (control && now_.control != before) NoteReservedOfMode(*now_.control, frame);
    for (std::size_t i = 0; i < kTargets.size(); ++i) {
      if (!news.has(kTargets[i])) continue;
      const std::optional<std::int64_t> target = values[kTargets[i]];
      outputs_changed_ = outputs_changed_ || now_.target[i] != target;
      now_.target[i] = target;
      now_.target_mapped[i] = true;
    }
    if (news.HasOneOf(kLimits)) TakeLimits(values);
    if (news.has(Role::kSafetyCommand)) now_.safety_command = static_cast<std::uint8_t>(*values[Role::kSafetyCommand]);
  }
  outputs_changed_ = outputs_changed_ || words_changed_;
  // Otherwise the inputs of this frame follow.
  const bool alone = !status_mapped_ || !now_.status;
  if (now_.control_changed || now_.control_first || alone) Step(frame);
}

void AxisWatch::TakeLimits(const AxisValues& values) {
  for (std::size_t i = 0; i < kLimitRoles.size(); ++i) {
    if (!values[kLimitRoles[i]]) continue;
    limit_is_zero_[i] = *values[kLimitRoles[i]] == 0;
    limit_mapped_[i] = true;
  }
}

/// By the mode of now: what is 0 may be of another one.
void AxisWatch::FindZeroLimit() {
  now_.zero_limit = 0;
  if (limit_is_zero_.none()) return;
  const std::int8_t mode = now_.mode().value_or(kCyclicPosition);
  for (std::size_t i = 0; i < kLimitRoles.size(); ++i) {
    if (!limit_is_zero_[i]) continue;
    const Role limit = kLimitRoles[i];
    if (limit == Role::kProfileSpeed && mode != kProfilePosition) continue;
    if (limit == Role::kAcceleration && mode != kProfilePosition && mode != kProfileVelocity) continue;
    if (limit >= Role::kHomingMethod && mode != kHoming) continue;
    now_.zero_limit = ObjectOf(limit);
    now_.zero_by_sdo = !limit_mapped_[i];
    return;
  }
}

[[gnu::always_inline]] inline void AxisWatch::TakeInputs(const AxisValues& values, Look look, const FrameRef& frame,
                                                         const SlaveSide& slave) {
  Side(slave);
  const bool all = look == Look::kAll || words_changed_;
  if (values.has(Role::kStatus)) status_frame_ = frame.number;
  if (all || values.changed()) {
    const RoleSet news = all ? values.mapped() : values.news();
    if (news.has(Role::kStatus)) {
      status_mapped_ = true;
      TakeStatus(*values[Role::kStatus], frame);
    }
    if (all || values.changed(Role::kMode) || values.changed(Role::kModeShown)) TakeModes(values, frame);
    if (news.has(Role::kDigitalInputs)) {
      TakeDigitalInputs(*values[Role::kDigitalInputs], frame);
    }
    if (now_.state_changed) KeepInputsAtDrop(frame);
    if (news.has(Role::kErrorCode)) error_code_ = static_cast<std::uint16_t>(*values[Role::kErrorCode]);
    for (std::size_t i = 0; i < kActuals.size(); ++i) {
      if (news.has(kActuals[i])) now_.actual[i] = values[kActuals[i]];
    }
  }
  if (shifted_ != nullptr && values.has(Role::kModeShown)) ConfirmShown(frame);
  Step(frame);
}

void AxisWatch::TakeDigitalInputs(std::int64_t value, const FrameRef& frame) {
  now_.switches = static_cast<std::uint16_t>(value & (kNegativeSwitch | kPositiveSwitch));
  const auto inputs = static_cast<std::uint32_t>(value & 0xFFFFFFFF);
  if (inputs_ && *inputs_ != inputs) input_change_ = {frame, *inputs_, inputs};
  inputs_ = inputs;
}

/// A master shows inputs and status word together, but the drive may set one of them some cycles later.
void AxisWatch::KeepInputsAtDrop(const FrameRef& frame) {
  constexpr TimeNs kTogether = 20'000'000;
  constexpr std::size_t kMost = 16;
  if (now_.state_before != device::DriveState::kOperationEnabled || !input_change_.frame.has_time) return;
  if (!frame.has_time || drops_.size() >= kMost) return;
  if (Elapsed(input_change_.frame.time, frame.time) > kTogether) return;
  drops_.emplace_back(frame.number, input_change_);
}

void AxisWatch::OnSdo(Role role, std::int64_t value, bool download, const FrameRef& frame, const SlaveSide& slave) {
  TakeCollected();
  Side(slave);
  switch (role) {
    case Role::kControl:
      if (!download) return;
      if (now_.control_mapped) {
        GetChecks().enable.OnSdoControl(now_, static_cast<std::uint16_t>(value), frame);
      } else {
        const std::optional<std::uint16_t> before = now_.control;
        TakeControl(value, frame);
        if (now_.control != before) NoteReservedOfMode(*now_.control, frame);
        Step(frame);
      }
      return;
    case Role::kStatus:
      if (download || status_mapped_) return;
      TakeStatus(value, frame);
      Step(frame);
      return;
    case Role::kMode:
      if (!download) return;
      now_.mode_by_sdo = static_cast<std::int8_t>(value);
      now_.FindMode();
      words_changed_ = way_changed_ = true;
      return;
    case Role::kModeShown:
      FollowShown(value, download, frame);
      return;
    case Role::kTargetPosition:
    case Role::kTargetVelocity:
    case Role::kTargetTorque:
    case Role::kTargetSpeed: {
      const std::size_t i = static_cast<std::size_t>(role) - static_cast<std::size_t>(Role::kTargetPosition);
      if (download && !now_.target_mapped[i]) now_.target[i] = value;
      return;
    }
    default:
      for (std::size_t i = 0; i < kLimitRoles.size(); ++i) {
        if (kLimitRoles[i] == role && !limit_mapped_[i]) limit_is_zero_[i] = value == 0;
      }
      return;
  }
}

/// What the drive shows by SDO is what it has; process data that show another value for long are read at a wrong place.
void AxisWatch::FollowShown(std::int64_t value, bool download, const FrameRef& frame) {
  if (download || !now_.mode_shown || *now_.mode_shown == value) return;
  const FrameRef& since = shown_since_;
  if (!since.has_time || !frame.has_time || Elapsed(since.time, frame.time) < kSettledNs) return;
  now_.frame = frame;
  AxisRecord record = now_.Record(AxisFact::kModeShifted, since, Elapsed(since.time, frame.time));
  record.a = value;
  record.b = *now_.mode_shown;
  shifted_ = std::make_unique<Shifted>(Shifted{record, {}});
}

/// The answer of a drive that changes its mode may come before the inputs that show it: shifted_ waits for them.
void AxisWatch::ConfirmShown(const FrameRef& frame) {
  if (now_.mode_shown != shifted_->record.b) {
    shifted_.reset();
    return;
  }
  if (shifted_->after.Hold(true, frame) < kStaysNs) return;
  records_.Add(shifted_->record);
  shifted_.reset();
}

void AxisWatch::TakeControl(std::int64_t word, const FrameRef& frame) {
  const auto value = static_cast<std::uint16_t>(word);
  control_seen_ = true;
  seen_in_op_ = seen_in_op_ || now_.in_op == InOp::kYes;
  if (now_.in_op == InOp::kYes) NoteReserved(reserved_control_, reserved_control_mask_, value, frame);
  if (!now_.control) {
    now_.control_first = true;
    now_.control_since = frame;
    now_.control_before = value;
  } else if (*now_.control != value) {
    now_.control_changed = true;
    now_.control_before = *now_.control;
    now_.control_since = frame;
  }
  if (now_.control != value) words_changed_ = way_changed_ = true;
  now_.control = value;
}

inline void AxisWatch::TakeStatus(std::int64_t word, const FrameRef& frame) {
  status_seen_ = true;
  status_frame_ = frame.number;
  const auto value = static_cast<std::uint16_t>(word);
  // Drives are known that toggle a bit in each cycle.
  const std::uint16_t changed = now_.status ? *now_.status ^ value : 0xFFFF;
  // 0 may mean that no inputs were valid yet.
  const bool same = state_known_ && !words_changed_ && (changed & status_bits_) == 0 && value != 0 && value != changed;
  if (changed != 0) {
    words_changed_ = true;
    // The others show nothing of the way to Operation enabled.
    if ((changed & kWayBits) != 0 || !now_.enabled()) way_changed_ = true;
  }
  now_.status = value;
  seen_in_op_ = seen_in_op_ || now_.in_op == InOp::kYes;
  if (drive_ != nullptr && !same) TakeState(changed, frame);
}

/// Of a new status word.  @param changed  bits of it
[[gnu::noinline]] void AxisWatch::TakeState(std::uint16_t changed, const FrameRef& frame) {
  if ((changed & state_bits_) != 0 || !state_known_) now_.state = drive_->StateOf(*now_.status);
  state_known_ = true;
  if (!now_.state) return;
  if (now_.in_op == InOp::kYes && *now_.status != 0 && odd_status_.bits == 0) {
    const auto odd = static_cast<std::uint16_t>((*now_.status ^ level_) & level_mask_);
    if (odd != 0) odd_status_ = {odd, *now_.status, frame, std::nullopt};
  }
  if (now_.state != last_state_) {
    now_.state_changed = true;
    now_.state_before = last_state_;
    now_.state_since = frame;
    if (IsFault(now_.state) && last_state_ && !IsFault(last_state_) && faults_.size() < kFaults) {
      faults_.emplace_back(frame.number, now_.Lead());
    }
    if (last_state_ == DriveState::kOperationEnabled) {
      // Outputs that are not known may hold another control word than an SDO.
      const bool known = now_.control_mapped || now_.began;
      lost_unasked_ = known && !AsksToStop() && !AskedToStop(frame);
      lost_by_fault_ = IsFault(now_.state);
    }
    last_state_ = now_.state;
  }
  if (IsFault(now_.state)) {
    without_fault_.End(frame);
  } else if (*now_.status != 0) {
    without_fault_.Begin(frame);
  }
  if (now_.Status(kVoltageBit)) {
    voltage_.Begin(frame);
  } else {
    if (voltage_.holds()) voltage_lost_unasked_ = now_.Control(kEnableOperationBit) && !AsksToStop();
    voltage_.End(frame);
  }
  if (now_.enabled()) {
    enabled_.Begin(frame);
    lost_unasked_ = false;
  } else {
    enabled_.End(frame);
  }
}

bool AxisWatch::AsksToStop() const {
  return now_.leaving || (now_.control && (*now_.control & kEnableWord) != kEnableWord);
}

bool AxisWatch::AskedToStop(const FrameRef& frame) const {
  const FrameRef& since = now_.control_since;
  return (now_.control_before & kEnableWord) != kEnableWord && since.has_time && frame.has_time &&
         Elapsed(since.time, frame.time) <= kLeadNs;
}

void AxisWatch::TakeModes(const AxisValues& values, const FrameRef& frame) {
  const std::optional<std::int8_t> before = now_.mode();
  if ((values.has(Role::kMode) && now_.mode_mapped != values[Role::kMode]) ||
      (values.has(Role::kModeShown) && now_.mode_shown != values[Role::kModeShown])) {
    words_changed_ = way_changed_ = true;
  }
  if (values[Role::kMode]) now_.mode_mapped = static_cast<std::int8_t>(*values[Role::kMode]);
  if (values[Role::kModeShown]) {
    const auto shown = static_cast<std::int8_t>(*values[Role::kModeShown]);
    if (now_.mode_shown != shown) shown_since_ = frame;
    now_.mode_shown = shown;
  }
  now_.FindMode();
  if (now_.mode() != before) {
    now_.mode_since = frame;
    now_.mode_seen_to_change = before.has_value();
  }
  const auto asked = now_.mode_asked();
  const bool shown = now_.mode_shown && *now_.mode_shown != 0 && (!asked || asked == now_.mode_shown);
  if (shown) {
    mode_.Begin(frame);
  } else if (now_.mode_shown) {
    mode_.End(frame);
  }
}

void AxisWatch::AssumeMode(const AxisValues& values) {
  constexpr std::array kModes{kCyclicPosition, kCyclicVelocity, kCyclicTorque};
  std::optional<std::int8_t> only;
  for (std::size_t i = 0; i < kModes.size(); ++i) {
    if (!values[kTargets[i]]) continue;
    if (only) return;
    only = kModes[i];
  }
  now_.mode_assumed = only;
  now_.FindMode();
}

void AxisWatch::Step(const FrameRef& frame) {
  now_.frame = frame;
  if (paused_ != nullptr && now_.control && now_.state) Resume();
  FindZeroLimit();
  if (drive_ != nullptr && seen()) {
    Checks& checks = GetChecks();
    if (way_changed_ || checks.enable.active()) checks.enable.Step(now_, records_);
    if (way_changed_ || !checks.command.settled() || checks.command.active()) {
      checks.command.Step(now_, records_);
    } else {
      checks.command.GoesOn(now_);
    }
    checks.setpoint.Step(now_, records_);
    checks.follow.Step(now_, records_);
  }
  now_.control_changed = now_.control_first = now_.state_changed = false;
  words_changed_ = way_changed_ = outputs_changed_ = false;
  Remember();
}

/// Where both words are what they were, and hardly anything can have happened in between, the gap changes nothing of
/// what lasts. What moves in each cycle begins again.
void AxisWatch::Resume() {
  const std::unique_ptr<Paused> paused = std::move(paused_);
  const AxisView& before = paused->before;
  if (now_.control != before.control || now_.state != before.state) return;
  if (!now_.frame.has_time || !before.frame.has_time) return;
  if (Elapsed(before.frame.time, now_.frame.time) > kShortGapNs) return;
  now_.control_first = now_.control_changed = now_.state_changed = false;
  now_.control_before = before.control_before;
  now_.control_since = before.control_since;
  now_.state_before = before.state_before;
  now_.state_since = before.state_since;
  checks_->enable = paused->enable;
  checks_->command = paused->command;
}

void AxisWatch::Remember() {
  now_.before = now_.Moment();
  if (!now_.frame.has_time) return;
  if (recent_.empty() || now_.frame.time >= recent_stays_until_) RememberForLong();
}

void AxisWatch::RememberForLong() {
  const auto age = [&](const AxisMoment& old) { return Elapsed(old.frame.time, now_.frame.time); };
  const bool due = recent_.empty() || age(recent_.back()) >= kLeadNs / kLeadSteps;
  if (due) recent_.push_back(now_.before);
  // The oldest one may be older than that: nothing changed in between.
  const bool over = recent_.size() > 1 && age(recent_[1]) >= kLeadNs;
  while (recent_.size() > 1 && age(recent_[1]) >= kLeadNs) recent_.erase(recent_.begin());
  if (due || over) now_.earlier = recent_.front();
  const auto later = [](const AxisMoment& old, TimeNs by) {
    TimeNs sum = 0;
    return __builtin_add_overflow(old.frame.time, by, &sum) ? std::numeric_limits<TimeNs>::max() : sum;
  };
  recent_stays_until_ = later(recent_.back(), kLeadNs / kLeadSteps);
  if (recent_.size() > 1) recent_stays_until_ = std::min(recent_stays_until_, later(recent_[1], kLeadNs));
}

void AxisWatch::ForgetAtGap() {
  TakeCollected();
  std::unique_ptr<Paused> paused;
  if (checks_ != nullptr && now_.control && now_.state) {
    paused = std::make_unique<Paused>(Paused{now_, checks_->enable, checks_->command});
  }
  SetpointCheck kept;
  if (checks_ != nullptr) kept = checks_->setpoint.AfterGap();
  Forget();
  if (checks_ != nullptr) checks_->setpoint = kept;
  paused_ = std::move(paused);
}

void AxisWatch::Forget() {
  TakeCollected();
  paused_.reset();
  collected_.reset();
  shifted_.reset();
  limit_is_zero_.reset();
  limit_mapped_.reset();
  AxisView fresh;
  fresh.control_mapped = now_.control_mapped;
  fresh.limits = now_.limits;
  fresh.error_bit_differs = now_.error_bit_differs;
  fresh.target_mapped = now_.target_mapped;
  now_ = fresh;
  state_known_ = false;
  recent_.clear();
  last_state_.reset();
  inputs_.reset();
  input_change_ = {};
  words_changed_ = way_changed_ = true;
  newest_outputs_.forgotten = newest_inputs_.forgotten = true;
  if (checks_ == nullptr) return;
  checks_->enable.Forget();
  checks_->command.Forget();
  checks_->setpoint.Forget();
  checks_->follow.Forget();
}

}  // namespace ecaudit::progress
