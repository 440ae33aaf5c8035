#include "analyzers/model/drive_unit.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "analyzers/model/drive_paths.h"
#include "analyzers/model/process_image.h"
#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

using device::DriveState;

/// The number that begins with this bit; nothing where it does not lie in the data.
/// @tparam kWhole  DrivePart::LieIn() holds: nearly always, and then it is a load
template <typename T, bool kWhole = false>
[[gnu::always_inline]] inline std::optional<T> Read(ByteSpan data, std::uint32_t bit) {
  if constexpr (kWhole) {
    return static_cast<T>(LoadLittleEndian<std::make_unsigned_t<T>>(data.data() + bit / 8));
  } else {
    constexpr unsigned kBits = 8 * sizeof(T);
    if (std::uint64_t{bit} + kBits > std::uint64_t{data.size()} * 8) return std::nullopt;
    return static_cast<T>(ExtractBits(data, bit, kBits));
  }
}

/// Whether the number there is the known one.
template <bool kWhole = false, typename T>
[[gnu::always_inline]] inline bool Same(ByteSpan data, std::uint32_t bit, const std::optional<T>& known) {
  return known && Read<T, kWhole>(data, bit) == known;
}

}  // namespace

void DriveUnit::SetFamily(const device::DeviceDescription& family) {
  if (family_ == &family) return;
  family_ = &family;
  drive_ = family.drive ? &*family.drive : nullptr;
  al_states_.SetFamily(drive_);
  places_.SetFamily(drive_);
  faults_.SetFamily(family);
  ExpectNothing();
  if (drive_ == nullptr) return;
  control_.SetFamily(*drive_);
  status_.SetFamily(*drive_);
}

/// Nearly every cycle shows what the one before did.
/// @return false: nothing was done
template <bool kWhole>
[[gnu::always_inline]] inline bool DriveUnit::RepeatInputs(const ProcessCycle& cycle, const DrivePart& part) {
  const auto same = [&](const std::optional<std::uint32_t>& bit, const auto& known) {
    return !bit || Same<kWhole>(cycle.data, *bit, known);
  };
  if (!expected_.empty() || doubtful_.pending()) return false;
  if (!same(part.mode_shown, modes_.shown()) || !same(part.error_code, faults_.error_code())) return false;
  if (!part.status) return true;
  if (!status_.mapped || !status_.word || !al_states_.ShowsStatus()) return false;
  const auto word = Read<std::uint16_t, kWhole>(cycle.data, *part.status);
  if (!word) return false;
  if (*word == *status_.word) {
    status_.Repeat(cycle.frame());
    after_gap_ = false;
    return true;
  }
  if (!status_.Confirms(*word) || (part.mode_shown && !modes_.shown_is_of_this_run())) return false;
  status_.Confirm(*word, cycle.frame());
  after_gap_ = false;
  return true;
}

template <bool kWhole>
[[gnu::always_inline]] inline bool DriveUnit::OutputsRepeat(const ProcessCycle& cycle, const DrivePart& part,
                                                            bool done) const {
  if (part.controls > 0 && (!control_.mapped() || control_.taken != control_.sent ||
                            (done && control_.acts != al_states_.ActsOnControl()))) {
    return false;
  }
  for (std::size_t i = 0; i < part.controls; ++i) {
    if (!Same<kWhole>(cycle.data, part.control[i], control_.sent)) return false;
  }
  return !part.mode || !done ||
         (modes_.request_is_of_this_run() && Same<kWhole>(cycle.data, *part.mode, modes_.requested()));
}

/// @return false: nothing was done, the words are to be taken
template <bool kWhole>
[[gnu::always_inline]] inline bool DriveUnit::Repeat(const ProcessCycle& cycle, const DrivePart& part) {
  const bool done = cycle.exchange == Exchange::kInferred || cycle.exchange == Exchange::kYes;
  if (cycle.part.direction == device::PdoDirection::kRx) return OutputsRepeat<kWhole>(cycle, part, done);
  return !done || RepeatInputs<kWhole>(cycle, part);
}

std::uint8_t DriveUnit::OnCycle(const ProcessCycle& cycle) {
  if (drive_ == nullptr) return 0;
  const DrivePart* const part = places_.Last(cycle.part.serial, cycle.part.direction == device::PdoDirection::kTx);
  if (part == nullptr) return Take(cycle, places_.Of(cycle.part));
  if (!part->known || cycle.data.empty()) return part->axes;
  return part->LieIn(cycle.data) && Repeat<true>(cycle, *part) ? part->axes : Take(cycle, *part);
}

[[gnu::noinline]] std::uint8_t DriveUnit::Take(const ProcessCycle& cycle, const DrivePart& part) {
  if (!part.known || cycle.data.empty() || Repeat<false>(cycle, part)) return part.axes;
  if (cycle.part.direction == device::PdoDirection::kTx) {
    TakeInputs(cycle, part);
  } else {
    TakeOutputs(cycle, part);
  }
  return part.axes;
}

void DriveUnit::TakeInputs(const ProcessCycle& cycle, const DrivePart& part) {
  const bool inferred = cycle.exchange == Exchange::kInferred;
  if (part.error_code) {
    const auto code = Read<std::uint16_t>(cycle.data, *part.error_code);
    if (code) faults_.OnErrorCode(*code, part.error_object, cycle.frame());
  }
  if (part.status) {
    const auto word = Read<std::uint16_t>(cycle.data, *part.status);
    status_.mapped = status_.mapped || word;
    if (word) OnStatus(*word, cycle.frame(), false, inferred);
  }
  if (part.mode_shown) {
    const auto mode = Read<std::int8_t>(cycle.data, *part.mode_shown);
    if (mode) OnMode(*mode, true, cycle.frame(), false, inferred);
  }
}

void DriveUnit::TakeOutputs(const ProcessCycle& cycle, const DrivePart& part) {
  const bool done = cycle.exchange == Exchange::kInferred || cycle.exchange == Exchange::kYes;
  if (part.controls > 0) OnControlWords(cycle, part, done);
  if (part.mode && done) {
    const auto mode = Read<std::int8_t>(cycle.data, *part.mode);
    const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
    if (mode) OnMode(*mode, false, frame, false, cycle.exchange == Exchange::kInferred);
  }
}

void DriveUnit::OnControlWords(const ProcessCycle& cycle, const DrivePart& part, bool done) {
  const auto word = Read<std::uint16_t>(cycle.data, part.control[0]);
  bool same = word.has_value();
  for (std::size_t i = 1; i < part.controls && same; ++i) same = Same(cycle.data, part.control[i], word);
  if (!same) {
    // No manual states which of several mapped control words counts.
    if (word) ++control_.ambiguous;
    ForgetCommands();
    return;
  }
  const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
  control_.way = DriveControl::Way::kMapped;
  if (control_.sent != word) OnControlSent(*word, frame, false);
  if (done) {
    const bool repeats = control_.taken == word && control_.acts == al_states_.ActsOnControl();
    if (!repeats) OnControlTaken(*word, frame, false, cycle.exchange == Exchange::kInferred);
  } else if (cycle.exchange == Exchange::kUnknown && control_.taken != word && al_states_.ActsOnControl()) {
    // Perhaps the drive took it.
    given_.Add(drive_->CommandedAnywhere(control_.taken.value_or(*word), *word), *word, frame);
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
      if (control_.mapped()) return;  // process data overwrite it
      control_.way = DriveControl::Way::kSdo;
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
  constexpr std::int64_t kInputsStopped = 100'000'000;  // ns without inputs: no process data have such a cycle
  const FrameRef& asked = transfer.request;
  const FrameRef& last = status_.last;
  if (!asked.seen() || asked.number <= last.number || !asked.has_time || !last.has_time) return false;
  return Elapsed(last.time, asked.time) >= kInputsStopped;
}

void DriveUnit::OnMode(std::int8_t value, bool shown, const FrameRef& frame, bool by_sdo, bool inferred) {
  const bool changed = modes_.On(value, shown, frame, by_sdo, inferred);
  if (changed && !shown) settings_since_ = frame;
}

void DriveUnit::ForgetObject(std::uint16_t index) {
  if (places_.InFirstAxis(index) == kModesOfOperation) modes_.ForgetRequest();
}

void DriveUnit::OnRunBegan() {
  Forget();
  modes_.OnRunBegan();
}

void DriveUnit::Forget() {
  ForgetCommands();
  settings_since_ = {};
  after_gap_ = true;
}

void DriveUnit::OnEmergency(const mailbox::Emergency& emergency) {
  if (drive_ != nullptr) faults_.OnEmergency(emergency);
}

// --- control word -----------------------------------------------------------------------------------------------

void DriveUnit::ExpectNothing() {
  expected_.Clear();
  doubtful_.Clear();
}

void DriveUnit::ForgetCommands() {
  control_.sent.reset();
  control_.taken.reset();
  ExpectNothing();
}

void DriveUnit::OnControlSent(std::uint16_t word, const FrameRef& frame, bool by_sdo) {
  if (!by_sdo && frame.number < al_.since()) return;  // a frame whose loss shows late: the slave has changed since
  const std::optional<std::uint16_t> before = std::exchange(control_.sent, word);
  if (!al_states_.SurelyDoesNotAct()) return;
  const int rank = RankOf(*drive_, word);
  if (rank < 2 || (before && rank <= RankOf(*drive_, *before))) return;
  sink_.Publish(DriveCommandOutsideOp{slave_, axis_, frame, word, al_.possible().single(), by_sdo});
}

void DriveUnit::OnControlTaken(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred) {
  // Without process data the mailbox carries the control word, which drives outside the manuals act on in PREOP too.
  const bool acts = al_states_.ActsOnControl() || (by_sdo && drive_->control_word_in.empty());
  const DriveControl::News news = control_.Take(word, frame, acts, inferred);
  // Bits of the mode (new set-point) and of the maker (heartbeats) take no torque away.
  if (!news.before || news.changed) settings_since_ = frame;
  if (news.motion != 0) {
    sink_.Publish(DriveBits{slave_, axis_, frame, *news.before, word, news.motion,
                            modes_.shown() ? modes_.shown() : modes_.requested(), by_sdo, inferred});
  }
  if (news.first) given_.OnFirst(acts);
  if (!acts || !news.any()) return;
  // A word that was there before the drive looked, or before the capture began, has its levels, but no edges.
  const std::uint16_t edge_from = news.changed ? *news.before : word;
  given_.Add(drive_->CommandedAnywhere(edge_from, word), word, frame);
  const bool commands = status_.state && drive_->Commanded(*status_.state, edge_from, word) != 0;
  if (news.changed || commands) Command(news.before, word, frame, by_sdo);
}

void DriveUnit::Command(std::optional<std::uint16_t> before, std::uint16_t word, const FrameRef& frame, bool by_sdo) {
  doubtful_.OnWord(*drive_, word, StatusesNeeded());
  const std::optional<DriveState> state = status_.state;
  const std::uint16_t edge_from = before.value_or(word);
  const int rank = RankOf(*drive_, word);
  DrivePath path;
  if (state && drive_->Commanded(*state, edge_from, word) != 0) {
    path = expected_.Begin(*drive_, *state, edge_from, word, frame);
  } else {
    // The status word may not show yet what was commanded before.
    if (!state || rank == 0) expected_.Clear();
    path = expected_.GoOn(*drive_, edge_from, word, frame);
  }
  sink_.Publish(DriveCommanded{slave_, axis_, frame, before, word, state, path, by_sdo, control_.inferred});

  const bool rises = before && rank > RankOf(*drive_, *before);
  if (!rises || !state || !path.empty() || rank <= LevelOf(*state)) return;
  // These are passed within moments, and a command may come early.
  if (*state == DriveState::kNotReadyToSwitchOn || *state == DriveState::kFaultReactionActive) return;
  doubtful_.Begin({slave_, axis_, frame, *before, word, *state, status_.state_since.number, control_.inferred});
}

// --- status word ------------------------------------------------------------------------------------------------

void DriveUnit::OnStatus(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred) {
  if (!al_states_.ShowsStatus() && !(by_sdo && drive_->status_word_in.empty())) return;
  const std::optional<std::uint16_t> before = status_.word;
  if (before != word) {
    if (!status_.Take(word, frame, by_sdo)) return;
    const bool warned = before && (*before & DriveStatus::kWarningBit) != 0;
    const bool warns = (word & DriveStatus::kWarningBit) != 0;
    if (warned != warns) sink_.Publish(DriveWarning{slave_, axis_, frame, word, warns, inferred});
    const std::optional<DriveState> to = drive_->StateOf(word);
    if (to != status_.state || !before) OnChange(status_.Change(to, frame, inferred));
  }
  status_.Repeat(frame);
  after_gap_ = false;
  if (!expected_.empty() || doubtful_.pending()) CheckLimits(frame);
}

void DriveUnit::OnChange(DriveStateChanged change) {
  change.slave = slave_;
  change.axis = axis_;
  if (!after_gap_) change.settings_since = settings_since_;
  // No state, or only words without one lay between.
  if (!change.to || change.to == change.from) return sink_.Publish(change);
  const bool explained = Explain(change);
  sink_.Publish(change);
  if (!explained) OnUnexplained(change);
  doubtful_.OnState(*drive_, *change.to, control_.taken, control_.mask);
  if (!IsFaultState(*change.to)) {
    faults_.OnFaultLeft();
  } else if (!change.from || !IsFaultState(*change.from)) {
    faults_.OnFault(change.frame);
  }
}

/// Finds out how the drive got there: its path and the command.
/// @return false: no command that is known leads there
bool DriveUnit::Explain(DriveStateChanged& change) {
  const bool power_on = *change.to == DriveState::kNotReadyToSwitchOn;
  if (change.from && !power_on && expected_.Fulfil(change)) {
    given_.UseUp(change.path);
    return true;
  }
  expected_.Clear();
  if (change.from && power_on) change.path.Add(0);
  if (!change.from || power_on) return true;
  const std::uint32_t given = given_.GivenSince(status_.known.last, limits_.reaction_ns).transitions;
  const auto path = FindDrivePath(*drive_, *change.from, *change.to, kOwnTransitions | given);
  if (!path) return false;
  change.path = *path;
  change.command = given_.CommandOf(*drive_, *path, given);
  given_.UseUp(*path);
  return true;
}

void DriveUnit::OnUnexplained(const DriveStateChanged& change) {
  const GivenCommands::Since given = given_.GivenSince(status_.known.last, limits_.reaction_ns);
  const bool in_op = al_.possible().empty() || al_.SettledIn(esc::AlState::OP);
  if (!control_.taken || !control_.acts || !in_op || !given.whole || change.first_zero || after_gap_) {
    ++unjudged_;
    return;
  }
  DriveIllegalChange illegal;
  illegal.slave = slave_;
  illegal.axis = axis_;
  illegal.frame = change.frame;
  illegal.from = *change.from;
  illegal.to = *change.to;
  illegal.from_last = change.from_last;
  illegal.word_before = *change.word_before;
  illegal.word = change.word;
  illegal.control = *control_.taken;
  illegal.control_since = control_.since.number;
  illegal.inferred = change.inferred || control_.inferred;
  if (const auto way = FindDrivePath(*drive_, *change.from, *change.to, ~0U)) {
    for (std::uint8_t i = 0; i < way->count; ++i) {
      if ((TransitionBit(way->numbers[i]) & (kOwnTransitions | given.transitions)) == 0) {
        illegal.missing.Add(way->numbers[i]);
      }
    }
  }
  sink_.Publish(illegal);
}

void DriveUnit::CheckLimits(const FrameRef& frame) {
  if (!control_.acts || !al_states_.ActsOnControl()) {
    ExpectNothing();
    return;
  }
  unsure_ = !al_states_.SurelyActs();
  if (unsure_) {
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
