#include "analyzers/model/drive_unit.h"

#include <algorithm>

#include "analyzers/model/drive_paths.h"
#include "analyzers/model/process_image.h"
#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

using device::DriveState;

constexpr std::uint16_t kWarningBit = 0x0080;
/// Of the control word: bits 4 to 6, whose meaning depends on the mode, and halt (bit 8).
constexpr std::uint16_t kMotionBits = 0x0170;

std::optional<std::uint64_t> Read(ByteSpan data, std::uint32_t bit, std::uint16_t bits) {
  if (std::uint64_t{bit} + bits > std::uint64_t{data.size()} * 8) return std::nullopt;
  if (bit % 8 == 0 && bits == 16) return LoadLittleEndian<std::uint16_t>(data.data() + bit / 8);
  return ExtractBits(data, bit, bits);
}

/// Whether the word there is the known one.
template <typename T>
bool Same(ByteSpan data, const DrivePart::Where& where, const std::optional<T>& known) {
  if (!known) return false;
  if (where.bits == 16 && where.bit % 8 == 0 && Fits(data, where.bit / 8, 2)) {  // nearly always
    return LoadLittleEndian<std::uint16_t>(data.data() + where.bit / 8) == static_cast<std::uint16_t>(*known);
  }
  const auto word = Read(data, where.bit, where.bits);
  return word && *known == static_cast<T>(*word);
}

}  // namespace

void DriveUnit::SetFamily(const device::DeviceDescription& family) {
  if (family_ == &family) return;
  family_ = &family;
  drive_ = family.drive ? &*family.drive : nullptr;
  al_states_.SetFamily(drive_);
  places_.SetFamily(drive_);
  faults_.SetFamily(family);
  control_mask_ = status_mask_ = motion_mask_ = 0;
  expected_.Clear();
  doubtful_.Clear();
  if (drive_ == nullptr) return;
  for (const device::DriveCommand& command : drive_->commands) {
    if (!command.automatic) control_mask_ = static_cast<std::uint16_t>(control_mask_ | command.mask);
  }
  motion_mask_ = kMotionBits;
  for (const device::EdgeAction& row : drive_->edge_actions) {
    motion_mask_ = static_cast<std::uint16_t>(motion_mask_ | 1U << row.bit);
  }
  motion_mask_ = static_cast<std::uint16_t>(motion_mask_ & ~control_mask_);
  for (const device::DriveStateRow& row : drive_->states) {
    status_mask_ = static_cast<std::uint16_t>(status_mask_ | row.printed.mask);
    for (const device::StatusPattern& also : row.also) {
      status_mask_ = static_cast<std::uint16_t>(status_mask_ | also.mask);
    }
  }
  if (status_.word && status_.state) status_.state = drive_->StateOf(*status_.word);
}

/// Nearly every cycle carries the words of the one before.
[[gnu::always_inline]] inline bool DriveUnit::InputsRepeat(const DrivePart& part, ByteSpan data) const {
  const auto same = [&](const std::optional<DrivePart::Where>& where, const auto& known) {
    return !where || Same(data, *where, known);
  };
  if (!expected_.empty() || doubtful_.pending()) return false;
  if (!same(part.status, status_.word) || !same(part.mode_shown, modes_.shown()) ||
      !same(part.error_code, faults_.error_code())) {
    return false;
  }
  return !part.status || (status_.seen && status_.mapped && al_states_.ShowsStatus());
}

[[gnu::always_inline]] inline bool DriveUnit::OutputsRepeat(const DrivePart& part, ByteSpan data, bool done) const {
  if (part.controls > 0 &&
      (!control_.mapped || control_.taken != control_.sent || (done && control_.acts != al_states_.ActsOnControl()))) {
    return false;
  }
  for (std::size_t i = 0; i < part.controls; ++i) {
    if (!Same(data, part.control[i], control_.sent)) return false;
  }
  return !part.mode || !done || (modes_.request_is_of_this_run() && Same(data, *part.mode, modes_.requested()));
}

std::uint8_t DriveUnit::OnCycle(const ProcessCycle& cycle) {
  if (drive_ == nullptr) return 0;
  const bool inputs = cycle.part.direction == device::PdoDirection::kTx;
  const DrivePart* last = places_.Last(cycle.part.serial, inputs);
  const DrivePart& part = last != nullptr ? *last : places_.Of(cycle.part);
  if (part.known && !cycle.data.empty()) {
    if (inputs) {
      OnInputs(cycle, part);
    } else {
      OnOutputs(cycle, part);
    }
  }
  return part.axes;
}

[[gnu::always_inline]] inline void DriveUnit::OnInputs(const ProcessCycle& cycle, const DrivePart& part) {
  if (cycle.exchange != Exchange::kInferred && cycle.exchange != Exchange::kYes) return;
  if (!InputsRepeat(part, cycle.data)) return TakeInputs(cycle, part);
  if (part.status) SeeState(cycle.frame());
}

/// The status word that is known came once more.
void DriveUnit::SeeState(const FrameRef& frame) {
  status_.last = frame;
  if (!status_.state) {
    CountWithoutState(frame);
    return;
  }
  known_.seen = frame;
  known_.word = *status_.word;
}

void DriveUnit::TakeInputs(const ProcessCycle& cycle, const DrivePart& part) {
  const bool inferred = cycle.exchange == Exchange::kInferred;
  if (part.error_code) {
    const auto code = Read(cycle.data, part.error_code->bit, 16);
    if (code) faults_.OnErrorCode(static_cast<std::uint16_t>(*code), part.error_object, cycle.frame());
  }
  if (part.status) {
    const auto word = Read(cycle.data, part.status->bit, 16);
    if (word) {
      status_.mapped = true;
      OnStatus(static_cast<std::uint16_t>(*word), cycle.frame(), false, inferred);
    }
  }
  if (part.mode_shown) {
    const auto mode = Read(cycle.data, part.mode_shown->bit, 8);
    if (mode) OnMode(static_cast<std::int8_t>(*mode), true, cycle.frame(), false, inferred);
  }
}

[[gnu::always_inline]] inline void DriveUnit::OnOutputs(const ProcessCycle& cycle, const DrivePart& part) {
  const bool done = cycle.exchange == Exchange::kInferred || cycle.exchange == Exchange::kYes;
  if (!OutputsRepeat(part, cycle.data, done)) TakeOutputs(cycle, part, done);
}

void DriveUnit::TakeOutputs(const ProcessCycle& cycle, const DrivePart& part, bool done) {
  if (part.controls > 0) OnControlWords(cycle, part, done);
  if (part.mode && done) {
    const auto mode = Read(cycle.data, part.mode->bit, 8);
    const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
    const bool inferred = cycle.exchange == Exchange::kInferred;
    if (mode) OnMode(static_cast<std::int8_t>(*mode), false, frame, false, inferred);
  }
}

void DriveUnit::OnControlWords(const ProcessCycle& cycle, const DrivePart& part, bool done) {
  const auto first = Read(cycle.data, part.control[0].bit, 16);
  bool same = first.has_value();
  for (std::size_t i = 1; i < part.controls && same; ++i) {
    same = Read(cycle.data, part.control[i].bit, 16) == first;
  }
  if (!same) {
    // No manual states which of several mapped control words counts.
    if (first) ++control_.ambiguous;
    control_.taken.reset();
    control_.sent.reset();
    expected_.Clear();
    doubtful_.Clear();
    return;
  }
  const auto word = static_cast<std::uint16_t>(*first);
  const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
  control_.seen = control_.mapped = true;
  if (control_.sent != word) OnControlSent(word, frame, false);
  if (done) {
    const bool inferred = cycle.exchange == Exchange::kInferred;
    const bool repeats = control_.taken == word && control_.acts == al_states_.ActsOnControl();
    if (!repeats) OnControlTaken(word, frame, false, inferred);
  } else if (cycle.exchange == Exchange::kUnknown && control_.taken != word) {
    OnControlMaybeTaken(word, frame);
  }
}

void DriveUnit::OnSdo(const mailbox::SdoTransfer& transfer) {
  if (drive_ == nullptr || !transfer.has_object || transfer.complete_access || transfer.data_gap) return;
  const bool download = transfer.service == mailbox::SdoService::kDownload;
  const bool inferred = transfer.outcome == mailbox::SdoOutcome::kNotCaptured;
  if (transfer.outcome != mailbox::SdoOutcome::kCompleted && !(download && inferred)) return;
  if (transfer.data.empty() || transfer.size != transfer.data.size()) return;
  const FrameRef& frame = download || !transfer.response.seen() ? transfer.request : transfer.response;
  if (!frame.seen()) return;
  const auto word = [&] { return LittleEndian<std::uint16_t>(transfer.data, 0); };
  const std::uint16_t object = places_.InFirstAxis(transfer.index);
  switch (object) {
    case kControlWord:
      if (!download || transfer.size != 2) return;
      OnControlSent(word(), frame, true);
      if (control_.mapped) return;  // process data overwrite it
      control_.seen = true;
      OnControlTaken(word(), frame, true, inferred);
      return;
    case kStatusWord:
      if (download || transfer.size != 2 || (status_.mapped && !AskedLongAfterInputs(transfer))) return;
      OnStatus(word(), frame, true, false);
      return;
    case kModesOfOperation:
    case kModesDisplay:
      if (transfer.size != 1) return;
      if (transfer.index == kModesOfOperation ? download : !download) {
        OnMode(static_cast<std::int8_t>(transfer.data[0]), !download, frame, true, inferred);
      }
      return;
    default:
      if (!download) faults_.OnUpload(transfer, object, frame);
      return;
  }
}

/// Inputs no longer arrive, and only the mailbox shows the drive. In between two cycles it may be older than
/// they.
bool DriveUnit::AskedLongAfterInputs(const mailbox::SdoTransfer& transfer) const {
  constexpr std::int64_t kLong = 100'000'000;
  const FrameRef& asked = transfer.request;
  if (!asked.seen() || asked.number <= status_.last.number || !asked.has_time || !status_.last.has_time) return false;
  return Elapsed(status_.last.time, asked.time) >= kLong;
}

void DriveUnit::OnMode(std::int8_t value, bool shown, const FrameRef& frame, bool by_sdo, bool inferred) {
  const bool changed = modes_.On(value, shown, frame, by_sdo, inferred);
  if (changed && !shown) control_.settings_since = frame;
}

void DriveUnit::ForgetObject(std::uint16_t index) {
  if (places_.InFirstAxis(index) == kModesOfOperation) modes_.ForgetRequest();
}

void DriveUnit::OnRunBegan() {
  Forget();
  modes_.OnRunBegan();
}

void DriveUnit::Forget() {
  control_.sent.reset();
  control_.taken.reset();
  expected_.Clear();
  doubtful_.Clear();
  control_.settings_since = {};
  status_.behind_hole = true;
}

void DriveUnit::OnEmergency(const mailbox::Emergency& emergency) {
  if (drive_ != nullptr) faults_.OnEmergency(emergency);
}

// --- control word -----------------------------------------------------------------------------------------------

void DriveUnit::OnControlSent(std::uint16_t word, const FrameRef& frame, bool by_sdo) {
  if (!by_sdo && frame.number < al_.since()) return;  // a frame whose loss shows late: the slave has changed since
  const std::optional<std::uint16_t> before = control_.sent;
  control_.sent = word;
  if (drive_->control_word_in.empty()) return;
  if (before && ((*before ^ word) & control_mask_) == 0) return;
  const int rank = RankOf(*drive_, word);
  if (rank < 2 || (before && rank <= RankOf(*drive_, *before))) return;
  if (!al_states_.SurelyDoesNotAct()) return;
  sink_.Publish(DriveCommandOutsideOp{slave_, axis_, frame, word, al_.possible().single(), by_sdo});
}

void DriveUnit::OnControlTaken(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred) {
  const std::optional<std::uint16_t> before = control_.taken;
  // Without process data the mailbox carries the control word, which drives outside the manuals act on in PREOP too.
  const bool acts = al_states_.ActsOnControl() || (by_sdo && drive_->control_word_in.empty());
  const bool activated = acts && !control_.acts;
  const bool changed = before && ((*before ^ word) & control_mask_) != 0;
  control_.acts = acts;
  // Bits of the mode (new set-point) and of the maker (heartbeats) take no torque away.
  if (!before || changed) control_.settings_since = frame;
  control_.taken = word;
  control_.inferred = inferred;
  if (before && ((*before ^ word) & motion_mask_) != 0) {
    const auto bits = static_cast<std::uint16_t>((*before ^ word) & motion_mask_);
    sink_.Publish(DriveBits{slave_, axis_, frame, *before, word, bits,
                            modes_.shown() ? modes_.shown() : modes_.requested(), by_sdo, inferred});
  }
  if (!before && !control_.first.seen()) {
    control_.first = frame;
    given_.OnFirst(acts);
  }
  if (!before || changed || activated) control_.since = frame;
  if (!acts || (before && !changed && !activated)) return;
  // A word that was there before the drive looked, or before the capture began, has its levels, but no edges.
  const std::uint16_t edge_from = changed ? *before : word;
  given_.Add(drive_->CommandedAnywhere(edge_from, word), word, frame);
  const bool rises = changed && RankOf(*drive_, word) > RankOf(*drive_, *before);
  if (!changed && (!status_.state || drive_->Commanded(*status_.state, edge_from, word) == 0)) return;
  Command(before, word, frame, by_sdo, rises);
}

void DriveUnit::OnControlMaybeTaken(std::uint16_t word, const FrameRef& frame) {
  const std::uint16_t before = control_.taken.value_or(word);
  if (al_states_.ActsOnControl()) given_.Add(drive_->CommandedAnywhere(before, word), word, frame);
}

void DriveUnit::Command(std::optional<std::uint16_t> before, std::uint16_t word, const FrameRef& frame, bool by_sdo,
                        bool rises) {
  doubtful_.OnWord(*drive_, word, StatusesNeeded());
  const std::optional<DriveState> state = status_.state;
  const std::uint16_t edge_from = before.value_or(word);
  const int rank = RankOf(*drive_, word);
  DriveCommanded event;
  event.slave = slave_;
  event.axis = axis_;
  event.frame = frame;
  event.before = before;
  event.word = word;
  event.state = state;
  event.by_sdo = by_sdo;
  event.inferred = control_.inferred;
  if (state && drive_->Commanded(*state, edge_from, word) != 0) {
    event.path = expected_.Begin(*drive_, *state, edge_from, word, frame);
  } else {
    // The status word may not show yet what was commanded before.
    if (!state || rank == 0) expected_.Clear();
    event.path = expected_.GoOn(*drive_, edge_from, word, frame);
  }
  sink_.Publish(event);

  if (!rises || !before || !state || !event.path.empty() || rank <= LevelOf(*state)) return;
  // These are passed within moments, and a command may come early.
  if (*state == DriveState::kNotReadyToSwitchOn || *state == DriveState::kFaultReactionActive) return;
  doubtful_.Begin({slave_, axis_, frame, *before, word, *state, status_.state_since.number, control_.inferred});
}

// --- status word ------------------------------------------------------------------------------------------------

void DriveUnit::OnStatus(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred) {
  if (!al_states_.ShowsStatus() && !(by_sdo && drive_->status_word_in.empty())) return;
  status_.seen = true;
  status_.last = frame;
  const std::optional<std::uint16_t> before = status_.word;
  if (before != word) {
    status_.word = word;
    status_.by_sdo = by_sdo;
    // Before any other word, 0 is what unused memory holds.
    if (word == 0 && !known_.state) {
      status_.is_without_state = false;
      return;
    }
    const bool warned = before && (*before & kWarningBit) != 0;
    const bool warns = (word & kWarningBit) != 0;
    if (warned != warns) sink_.Publish(DriveWarning{slave_, axis_, frame, word, warns, inferred});
    // Nearly always only bits changed that do not belong to the state.
    const bool same_state = status_.state && before && ((*before ^ word) & status_mask_) == 0;
    const std::optional<DriveState> to = same_state ? status_.state : drive_->StateOf(word);
    if (to != status_.state || !before) OnState(to, frame, inferred);
  }
  if (status_.state) {
    known_.seen = frame;
    known_.word = word;
  } else {
    CountWithoutState(frame);
  }
  status_.behind_hole = false;
  if (!expected_.empty() || doubtful_.pending()) CheckLimits(frame);
}

void DriveUnit::CountWithoutState(const FrameRef& frame) {
  if (!status_.is_without_state) return;
  ++status_.without_state.words;
  status_.without_state.last = frame;
}

void DriveUnit::OnState(std::optional<DriveState> to, const FrameRef& frame, bool inferred) {
  DriveStateChanged change;
  change.slave = slave_;
  change.axis = axis_;
  change.frame = frame;
  change.from = known_.state;
  change.from_last = known_.seen.number;
  change.to = to;
  change.word = *status_.word;
  if (known_.state) change.word_before = known_.word;
  change.first_zero = known_.was_zero;
  change.by_sdo = status_.by_sdo;
  change.inferred = inferred;
  if (!status_.behind_hole) change.settings_since = control_.settings_since;
  status_.state = to;
  status_.is_without_state = !to;
  if (!to) {
    status_.without_state = {frame, frame, 0, change.word, change.from, change.from_last, inferred};
    sink_.Publish(change);
    return;
  }
  if (known_.state == to) {
    // Only words without a meaning lay between.
    sink_.Publish(change);
    return;
  }
  const bool enters_fault = IsFaultState(*to) && !(known_.state && IsFaultState(*known_.state));
  if (known_.state) {
    CheckChange(change);
  } else {
    expected_.Clear();
    sink_.Publish(change);
  }
  doubtful_.OnState(*drive_, *to, control_.taken, control_mask_);
  known_.state = to;
  known_.was_zero = *status_.word == 0;
  status_.state_since = frame;
  if (enters_fault) faults_.OnFault(frame);
  if (!IsFaultState(*to)) faults_.OnFaultLeft();
}

void DriveUnit::CheckChange(DriveStateChanged& change) {
  if (*change.to == DriveState::kNotReadyToSwitchOn) {
    change.path.Add(0);
    expected_.Clear();
    sink_.Publish(change);
    return;
  }
  if (expected_.Fulfil(change)) {
    given_.UseUp(change.path);
    sink_.Publish(change);
    return;
  }
  expected_.Clear();
  const GivenCommands::Since given = given_.GivenSince(known_.seen, limits_.reaction_ns);
  if (const auto path = FindDrivePath(*drive_, *change.from, *change.to, kOwnTransitions | given.transitions)) {
    change.path = *path;
    if (const FrameRef command = given_.CommandOf(*drive_, *path, given.transitions); command.seen()) {
      change.command = command;
    }
    given_.UseUp(*path);
    sink_.Publish(change);
    return;
  }
  sink_.Publish(change);
  // From here on what happened was not commanded.
  const bool in_op = al_.possible().empty() || al_.SettledIn(esc::AlState::OP);
  const bool unclear = !control_.taken || !control_.acts || !in_op || !given.whole;
  if (unclear || change.first_zero || status_.behind_hole) {
    ++unjudged_;
  } else {
    ReportIllegal(change, given.transitions);
  }
}

void DriveUnit::ReportIllegal(const DriveStateChanged& change, std::uint32_t given) {
  DriveIllegalChange illegal;
  illegal.slave = slave_;
  illegal.axis = axis_;
  illegal.frame = change.frame;
  illegal.from = *change.from;
  illegal.to = *change.to;
  illegal.from_last = known_.seen.number;
  illegal.word_before = known_.word;
  illegal.word = change.word;
  illegal.control = *control_.taken;
  illegal.control_since = control_.since.number;
  illegal.inferred = change.inferred || control_.inferred;
  if (const auto way = FindDrivePath(*drive_, *change.from, *change.to, ~0U)) {
    for (std::uint8_t i = 0; i < way->count; ++i) {
      if ((TransitionBit(way->numbers[i]) & (kOwnTransitions | given)) == 0) illegal.missing.Add(way->numbers[i]);
    }
  }
  sink_.Publish(illegal);
}

void DriveUnit::CheckLimits(const FrameRef& frame) {
  if (!control_.acts || !al_states_.ActsOnControl()) {
    expected_.Clear();
    doubtful_.Clear();
    return;
  }
  control_.unsure = !al_states_.SurelyActs();
  if (control_.unsure) {
    // The drive's time begins when it acts for certain.
    expected_.WaitFrom(frame);
    doubtful_.BeginAgain();
    return;
  }
  doubtful_.OnSameState(frame, limits_.reaction_ns, StatusesNeeded());
  if (expected_.empty() || status_.state != expected_.next().from) return;
  if (!frame.has_time || !expected_.since().has_time) {
    without_time_ = true;
    return;
  }
  const ExpectedSteps::Step& next = expected_.next();
  const std::int64_t limit =
      next.from == DriveState::kOperationEnabled ? limits_.leaving_operation_ns : limits_.reaction_ns;
  const std::int64_t waited = frame.time - expected_.since().time;
  if (waited <= limit) return;
  const device::DriveTransition* transition = drive_->Find(next.number);
  if (transition != nullptr && !transition->optional) {
    const std::int64_t since_command = next.command.has_time ? frame.time - next.command.time : waited;
    sink_.Publish(DriveNoReaction{slave_, axis_, frame, next.command, next.word, next.before, next.number,
                                  *status_.state, *status_.word, std::max(waited, since_command), limit,
                                  control_.inferred});
  }
  expected_.Clear();
}

}  // namespace ecaudit::model
