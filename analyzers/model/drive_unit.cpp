#include "analyzers/model/drive_unit.h"

#include <algorithm>

#include "analyzers/model/drive_axes.h"
#include "analyzers/model/process_image.h"
#include "analyzers/objects/relatives.h"
#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

using device::DriveState;

constexpr std::uint16_t kFirstOfAxis = 0x6000;  ///< objects before are the device's
constexpr std::uint16_t kModes = 0x6060;
constexpr std::uint16_t kModesDisplay = 0x6061;

constexpr std::uint16_t kWarningBit = 0x0080;
/// An emergency that is older does not explain a fault.
constexpr std::int64_t kEmergencyBeforeFault_ns = 1'000'000'000;

constexpr std::uint32_t Bit(unsigned number) {
  return number < 32 ? 1U << number : 0U;
}
/// Transitions that a drive takes without a command: the automatic ones, those that take torque away (no supply,
/// hardware enable, limit switch), and 15, since faults have other ways to be reset.
constexpr std::uint32_t kOwn = Bit(0) | Bit(1) | Bit(5) | Bit(6) | Bit(7) | Bit(8) | Bit(9) | Bit(10) | Bit(11) |
                               Bit(12) | Bit(13) | Bit(14) | Bit(15);

bool IsFault(DriveState state) {
  return state == DriveState::kFault || state == DriveState::kFaultReactionActive;
}

/// How far a state is on the way to Operation enabled, in the terms of DriveUnit::Rank().
int Level(DriveState state) {
  switch (state) {
    case DriveState::kReadyToSwitchOn:
      return 1;
    case DriveState::kSwitchedOn:
      return 2;
    case DriveState::kOperationEnabled:
      return 3;
    default:
      return 0;
  }
}

std::optional<std::uint64_t> Read(ByteSpan data, std::uint32_t bit, std::uint16_t bits) {
  if (std::uint64_t{bit} + bits > std::uint64_t{data.size()} * 8) return std::nullopt;
  if (bit % 8 == 0 && bits == 16) return LittleEndian<std::uint16_t>(data, bit / 8);
  return ExtractBits(data, bit, bits);
}

/// Whether the word there is the known one; it is watched from here on.
template <typename T>
bool Same(ByteSpan data, std::uint32_t bit, std::uint16_t bits, const std::optional<T>& known, StillCycle& watched) {
  return known && watched.Watch(data, bit, bits) && *known == static_cast<T>(*Read(data, bit, bits));
}

}  // namespace

void DriveUnit::SetFamily(const device::DeviceDescription& family) {
  if (family_ == &family) return;
  family_ = &family;
  drive_ = family.drive ? &*family.drive : nullptr;
  places_.clear();  // which objects say why the drive is in a fault is the family's
  next_places_ = 0;
  control_mask_ = 0;
  expected_count_ = 0;
  candidate_.reset();
  if (drive_ == nullptr) return;
  for (const device::DriveCommand& command : drive_->commands) {
    if (!command.automatic) control_mask_ = static_cast<std::uint16_t>(control_mask_ | command.mask);
  }
  if (status_ && state_) state_ = drive_->StateOf(*status_);
}

const DriveUnit::Places& DriveUnit::PlacesOf(const ImagePart& part) {
  if (part.places.empty()) {
    static const Places kNowhere;
    return kNowhere;
  }
  for (const Places& places : places_) {
    if (places.serial == part.serial) return places;
  }
  if (places_.empty()) places_.resize(kPlaces);
  Places& places = places_[next_places_];
  next_places_ = (next_places_ + 1) % places_.size();
  places = {};
  places.serial = part.serial;
  for (const ImagePart::Place& place : part.places) {
    const Place here{place.bit, place.bits};
    const auto index_mapped = static_cast<std::uint16_t>(place.object >> 8U);
    const auto subindex = static_cast<std::uint8_t>(place.object);
    if (const auto axis = DriveAxes::AxisOfWord(index_mapped, subindex, place.bits)) {
      places.axes = static_cast<std::uint8_t>(places.axes | 1U << *axis);
    }
    const auto is = [&](std::uint16_t index, unsigned bits) {
      return InFirstAxis(index_mapped) == index && subindex == 0 && place.bits == bits;
    };
    if (part.direction == device::PdoDirection::kRx) {
      if (is(kControlWord, 16) && places.controls < places.control.size()) places.control[places.controls++] = here;
      if (is(kModes, 8)) places.mode = here;
    } else {
      if (is(kStatusWord, 16)) places.status = here;
      if (is(kModesDisplay, 8)) places.mode_shown = here;
      if (MapsErrorCode(place.object, place.bits)) {
        places.error_code = here;
        places.error_object = InFirstAxis(index_mapped);
      }
    }
  }
  places.known = places.controls > 0 || places.mode || places.status || places.mode_shown || places.error_code;
  return places;
}

bool DriveUnit::MapsErrorCode(std::uint32_t object, std::uint16_t bits) const {
  const device::FaultObject* row =
      drive_->FindFaultObject(InFirstAxis(static_cast<std::uint16_t>(object >> 8U)), static_cast<std::uint8_t>(object));
  return row != nullptr && row->kind == device::FaultValue::kErrorCode && row->bits == bits && bits == 16;
}

std::uint16_t DriveUnit::InFirstAxis(std::uint16_t index) const {
  if (index < kFirstOfAxis) return index;  // of the device
  const std::uint16_t first = ObjectOfAxis(kFirstOfAxis, axis_);
  const bool own = index >= first && index < ObjectOfAxis(first, 1);
  return own ? static_cast<std::uint16_t>(kFirstOfAxis + (index - first)) : std::uint16_t{0};
}

std::uint8_t DriveUnit::AxesIn(const ProcessCycle& cycle) {
  return drive_ == nullptr ? std::uint8_t{0} : PlacesOf(cycle.part).axes;
}

bool DriveUnit::ActsOnControl() const {
  const StateSet possible = al_.possible();
  if (possible.empty()) return true;
  if (drive_->control_word_in.empty()) return possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  return std::any_of(drive_->control_word_in.begin(), drive_->control_word_in.end(),
                     [&](esc::AlState state) { return possible.contains(static_cast<std::uint8_t>(state)); });
}

/// ActsOnControl() in each state that the slave may be in, not only in some: a request of OP may take seconds.
bool DriveUnit::SurelyActs() const {
  const StateSet possible = al_.possible();
  StateSet acting;
  if (drive_->control_word_in.empty()) acting = StateSet::Of(static_cast<std::uint8_t>(esc::AlState::OP));
  for (const esc::AlState state : drive_->control_word_in) acting.Add(static_cast<std::uint8_t>(state));
  StateSet either = acting;
  either.Add(possible);
  return either == acting;
}

bool DriveUnit::ShowsStatus() const {
  const StateSet possible = al_.possible();
  if (possible.empty()) return true;
  if (drive_->status_word_in.empty()) {
    return possible.contains(static_cast<std::uint8_t>(esc::AlState::SAFEOP)) ||
           possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  }
  return std::any_of(drive_->status_word_in.begin(), drive_->status_word_in.end(),
                     [&](esc::AlState state) { return possible.contains(static_cast<std::uint8_t>(state)); });
}

/// How far the word wants the drive to go: 1 Ready to switch on, 2 Switched on, 3 Operation enabled, 0 none of these.
int DriveUnit::Rank(std::uint16_t word) const {
  const std::uint32_t commanded = drive_->CommandedAnywhere(0, word);
  if ((commanded & (Bit(4) | Bit(16))) != 0) return 3;
  if ((commanded & Bit(3)) != 0) return 2;
  return (commanded & Bit(2)) != 0 ? 1 : 0;
}

/// Nearly every cycle carries the words of the one before.
Still DriveUnit::InputsRepeat(const Places& places, ByteSpan data, StillCycle& watched) const {
  const auto same = [&](const std::optional<Place>& place, const auto& known) {
    return !place || Same(data, place->bit, place->bits, known, watched);
  };
  if (expected_count_ != 0 || candidate_) return Still::kNo;
  if (!same(places.status, status_) || !same(places.mode_shown, mode_shown_) || !same(places.error_code, error_code_)) {
    return Still::kNo;
  }
  if (!places.status) return Still::kIdle;
  return status_seen_ && status_mapped_ && ShowsStatus() ? Still::kCounts : Still::kNo;
}

Still DriveUnit::OutputsRepeat(const Places& places, ByteSpan data, bool done, StillCycle& watched) const {
  if (places.controls > 0 && (!control_mapped_ || control_ != sent_ || (done && acts_ != ActsOnControl()))) {
    return Still::kNo;
  }
  for (std::size_t i = 0; i < places.controls; ++i) {
    if (!Same(data, places.control[i].bit, places.control[i].bits, sent_, watched)) return Still::kNo;
  }
  return !places.mode || !done ||
                 (!mode_of_run_before_[0] && Same(data, places.mode->bit, places.mode->bits, mode_requested_, watched))
             ? Still::kIdle
             : Still::kNo;
}

void DriveUnit::Repeat(const ProcessCycle& cycle) {
  status_last_ = cycle.frame();
  if (!state_) {
    CountWithoutState(status_last_);
    return;
  }
  last_state_seen_ = status_last_;
  last_state_word_ = *status_;
}

Still DriveUnit::OnCycle(const ProcessCycle& cycle, StillCycle& watched) {
  if (drive_ == nullptr) return Still::kIdle;
  const Places& places = PlacesOf(cycle.part);
  if (!places.known) return Still::kIdle;
  const bool inputs = cycle.part.direction == device::PdoDirection::kTx;
  return inputs ? OnInputs(cycle, places, watched) : OnOutputs(cycle, places, watched);
}

Still DriveUnit::OnInputs(const ProcessCycle& cycle, const Places& places, StillCycle& watched) {
  const bool inferred = cycle.exchange == Exchange::kInferred;
  if (!inferred && cycle.exchange != Exchange::kYes) return Still::kIdle;
  if (cycle.data.empty()) return Still::kNo;
  if (const Still still = InputsRepeat(places, cycle.data, watched); still != Still::kNo) {
    if (still == Still::kCounts) Repeat(cycle);
    return still;
  }
  if (places.error_code) {
    const auto code = Read(cycle.data, places.error_code->bit, 16);
    if (code && error_code_ != *code) {
      error_code_ = static_cast<std::uint16_t>(*code);
      error_object_ = places.error_object;
      if (*code != 0) {
        Explain(DriveFaultExplained::Source::kErrorCode, error_object_, static_cast<std::uint32_t>(*code),
                cycle.frame());
      }
    }
  }
  if (places.status) {
    const auto word = Read(cycle.data, places.status->bit, 16);
    if (word) {
      status_mapped_ = true;
      OnStatus(static_cast<std::uint16_t>(*word), cycle.frame(), false, inferred);
    }
  }
  if (places.mode_shown) {
    const auto mode = Read(cycle.data, places.mode_shown->bit, 8);
    if (mode) OnMode(static_cast<std::int8_t>(*mode), true, cycle.frame(), false, inferred);
  }
  return Still::kNo;
}

Still DriveUnit::OnOutputs(const ProcessCycle& cycle, const Places& places, StillCycle& watched) {
  const bool inferred = cycle.exchange == Exchange::kInferred;
  const bool done = inferred || cycle.exchange == Exchange::kYes;
  if (cycle.data.empty()) return Still::kNo;
  if (OutputsRepeat(places, cycle.data, done, watched) == Still::kIdle) return Still::kIdle;
  if (places.controls > 0) OnControlWords(cycle, places, done);
  if (places.mode && done) {
    const auto mode = Read(cycle.data, places.mode->bit, 8);
    const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
    if (mode) OnMode(static_cast<std::int8_t>(*mode), false, frame, false, inferred);
  }
  return Still::kNo;
}

void DriveUnit::OnControlWords(const ProcessCycle& cycle, const Places& places, bool done) {
  const auto first = Read(cycle.data, places.control[0].bit, 16);
  bool same = first.has_value();
  for (std::size_t i = 1; i < places.controls && same; ++i) {
    same = Read(cycle.data, places.control[i].bit, 16) == first;
  }
  if (!same) {
    // Which of several mapped control words counts, no manual says.
    if (first) ++ambiguous_;
    control_.reset();
    sent_.reset();
    expected_count_ = 0;
    candidate_.reset();
    return;
  }
  const auto word = static_cast<std::uint16_t>(*first);
  const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
  control_seen_ = control_mapped_ = true;
  if (sent_ != word) OnControlSent(word, frame, false);
  if (done) {
    const bool inferred = cycle.exchange == Exchange::kInferred;
    if (control_ != word || acts_ != ActsOnControl()) OnControlTaken(word, frame, false, inferred);
  } else if (cycle.exchange == Exchange::kUnknown && control_ != word) {
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
  switch (InFirstAxis(transfer.index)) {
    case kControlWord:
      if (!download || transfer.size != 2) return;
      OnControlSent(word(), frame, true);
      if (control_mapped_) return;  // process data overwrite it
      control_seen_ = true;
      OnControlTaken(word(), frame, true, inferred);
      return;
    case kStatusWord:
      if (download || transfer.size != 2 || (status_mapped_ && !AskedLongAfterInputs(transfer))) return;
      OnStatus(word(), frame, true, false);
      return;
    case kModes:
    case kModesDisplay:
      if (transfer.size != 1) return;
      if (transfer.index == kModes ? download : !download) {
        OnMode(static_cast<std::int8_t>(transfer.data[0]), !download, frame, true, inferred);
      }
      return;
    default:
      if (!download) OnFaultObject(transfer, frame);
      return;
  }
}

/// What the family has beside the emergency to say why it is in a fault.
void DriveUnit::OnFaultObject(const mailbox::SdoTransfer& transfer, const FrameRef& frame) {
  const std::uint16_t index = InFirstAxis(transfer.index);
  const device::FaultObject* object = drive_->FindFaultObject(index, transfer.subindex);
  if (object == nullptr || transfer.size * 8 != object->bits) return;
  const bool number = object->kind == device::FaultValue::kFaultNumber && object->bits == 32;
  const std::uint32_t value =
      number ? LittleEndian<std::uint32_t>(transfer.data, 0) : LittleEndian<std::uint16_t>(transfer.data, 0);
  if (value == 0) return;
  using Source = DriveFaultExplained::Source;
  Explain(object->kind == device::FaultValue::kFaultNumber ? Source::kFaultNumber : Source::kErrorCode, index, value,
          frame);
}

/// Inputs come no more, and the mailbox is all that tells of the drive. In between two cycles it may be older than
/// they.
bool DriveUnit::AskedLongAfterInputs(const mailbox::SdoTransfer& transfer) const {
  constexpr std::int64_t kLong = 100'000'000;
  const FrameRef& asked = transfer.request;
  if (!asked.seen() || asked.number <= status_last_.number || !asked.has_time || !status_last_.has_time) return false;
  return Elapsed(status_last_.time, asked.time) >= kLong;
}

void DriveUnit::ForgetObject(std::uint16_t index) {
  if (InFirstAxis(index) == kModes) mode_requested_.reset();
}

void DriveUnit::OnRunBegan() {
  Forget();
  mode_of_run_before_ = {true, true};
}

void DriveUnit::Forget() {
  sent_.reset();
  control_.reset();
  expected_count_ = 0;
  candidate_.reset();
  settings_since_ = {};
  behind_hole_ = true;
}

void DriveUnit::OnEmergency(const mailbox::Emergency& emergency) {
  if (drive_ == nullptr) return;
  if (emergency.data.error_code == 0) {
    emergency_.reset();
    return;
  }
  const events::EmergencyInfo info = events::FindEmergency(family_, emergency.data.error_code);
  if (info.code != nullptr && info.code->kind != device::EmergencyKind::kFault) return;
  emergency_ = emergency.data;
  emergency_frame_ = emergency.frame;
  Explain(DriveFaultExplained::Source::kEmergency, 0, emergency.data.error_code, emergency.frame);
}

// --- control word -----------------------------------------------------------------------------------------------

void DriveUnit::OnControlSent(std::uint16_t word, const FrameRef& frame, bool by_sdo) {
  if (!by_sdo && frame.number < al_.since()) return;  // a frame whose loss shows late: the slave has changed since
  const std::optional<std::uint16_t> before = sent_;
  sent_ = word;
  if (drive_->control_word_in.empty()) return;
  if (before && ((*before ^ word) & control_mask_) == 0) return;
  if (Rank(word) < 2 || (before && Rank(word) <= Rank(*before))) return;
  const std::uint8_t state = al_.possible().single();
  if (!esc::IsAlState(state) || !al_.SettledIn(static_cast<esc::AlState>(state))) return;
  const bool acts = std::any_of(drive_->control_word_in.begin(), drive_->control_word_in.end(),
                                [&](esc::AlState in) { return static_cast<std::uint8_t>(in) == state; });
  if (!acts) sink_.Publish(DriveCommandOutsideOp{slave_, axis_, frame, word, state, by_sdo});
}

void DriveUnit::OnControlTaken(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred) {
  const std::optional<std::uint16_t> before = control_;
  // Without process data the mailbox carries the control word, which drives outside the manuals act on in PREOP too.
  const bool acts = ActsOnControl() || (by_sdo && drive_->control_word_in.empty());
  const bool activated = acts && !acts_;
  const bool changed = before && ((*before ^ word) & control_mask_) != 0;
  acts_ = acts;
  // Bits of the mode (new set-point) and of the maker (heartbeats) take no torque away.
  if (!before || changed) settings_since_ = frame;
  control_ = word;
  control_inferred_ = inferred;
  if (!before && !first_control_.seen()) {
    first_control_ = frame;
    history_whole_ = !acts;
  }
  if (!before || changed || activated) control_since_ = frame;
  if (!acts || (before && !changed && !activated)) return;
  // A word that was there before the drive looked, or before the capture began, has its levels, but no edges.
  const std::uint16_t edge_from = changed ? *before : word;
  AddGiven(drive_->CommandedAnywhere(edge_from, word), word, frame);
  const bool rises = changed && Rank(word) > Rank(*before);
  if (!changed && (!state_ || drive_->Commanded(*state_, edge_from, word) == 0)) return;
  Command(before, word, frame, by_sdo, rises);
}

void DriveUnit::OnControlMaybeTaken(std::uint16_t word, const FrameRef& frame) {
  const std::uint16_t before = control_.value_or(word);
  if (ActsOnControl()) AddGiven(drive_->CommandedAnywhere(before, word), word, frame);
}

void DriveUnit::AddGiven(std::uint32_t transitions, std::uint16_t word, const FrameRef& frame) {
  if (given_count_ > 0) {
    const GivenCommand& last = given_[(given_count_ - 1) % given_.size()];
    if (last.word == word && last.transitions == transitions) return;
  }
  if (given_.empty()) given_.resize(kGiven);
  given_[given_count_ % given_.size()] = {transitions, frame, word};
  ++given_count_;
}

/// What the drive has to do from `from` on, step by step, as long as the word commands it.
void DriveUnit::Expect(DriveState from, std::uint16_t before, std::uint16_t word, const FrameRef& frame) {
  if (expected_.empty()) expected_.resize(DrivePath::kMax);
  while (expected_count_ < expected_.size()) {
    const std::uint32_t commanded = drive_->Commanded(from, before, word);
    if (commanded == 0) return;
    std::uint8_t number = 0;
    while ((commanded >> number & 1U) == 0) ++number;
    const device::DriveTransition* transition = drive_->Find(number);
    if (transition == nullptr) return;
    expected_[expected_count_++] = {number, from, transition->to, frame, before, word};
    from = transition->to;
    before = word;  // the edges are used up
  }
}

void DriveUnit::Command(std::optional<std::uint16_t> before, std::uint16_t word, const FrameRef& frame, bool by_sdo,
                        bool rises) {
  FollowCandidate(word);
  const std::uint16_t edge_from = before.value_or(word);
  DriveCommanded event;
  event.slave = slave_;
  event.axis = axis_;
  event.frame = frame;
  event.before = before;
  event.word = word;
  event.state = state_;
  event.by_sdo = by_sdo;
  event.inferred = control_inferred_;
  std::size_t first = 0;  // of the transitions that this word commands
  if (state_ && drive_->Commanded(*state_, edge_from, word) != 0) {
    expected_count_ = 0;
    Expect(*state_, edge_from, word, frame);
  } else {
    // The status word may not show yet what was commanded before.
    std::size_t known = state_ && Rank(word) > 0 ? expected_count_ : 0;
    while (known > 0 && drive_->Commanded(expected_[known - 1].to, edge_from, word) == 0) --known;
    first = expected_count_ = known;
    if (known > 0) Expect(expected_[known - 1].to, edge_from, word, frame);
  }
  expected_since_ = frame;
  for (std::size_t i = first; i < expected_count_; ++i) event.path.Add(expected_[i].number);
  sink_.Publish(event);

  if (!rises || !before || !state_ || !event.path.empty() || Rank(word) <= Level(*state_)) return;
  // These are passed within moments, and a command may come early.
  if (*state_ == DriveState::kNotReadyToSwitchOn || *state_ == DriveState::kFaultReactionActive) return;
  Candidate candidate;
  candidate.command = {slave_, axis_, frame, *before, word, *state_, state_since_.number, control_inferred_};
  candidate_ = candidate;
}

/// A command that nothing offers may turn out right: the drive was about to change its state, or the word is Disable
/// operation and the first step of a switch-off sequence (7, 6, 0), which masters send whatever the state.
void DriveUnit::FollowCandidate(std::uint16_t word) {
  if (!candidate_) return;
  const int rank = Rank(word);
  const std::uint16_t doubtful = candidate_->command.word;
  const bool disables =
      Rank(doubtful) == 2 && (drive_->CommandedAnywhere(candidate_->command.before, doubtful) & Bit(5)) != 0;
  if (disables && rank == 1) {
    candidate_->going_down = true;
  } else if (candidate_->going_down && rank == 0) {
    candidate_.reset();
  } else {
    ConfirmCandidate();
  }
}

/// The status word that comes back with a control word is older than it.
unsigned DriveUnit::StatusesNeeded() const {
  return status_by_sdo_ ? 1 : 2;
}

void DriveUnit::ConfirmCandidate() {
  if (candidate_->statuses >= StatusesNeeded()) sink_.Publish(candidate_->command);
  candidate_.reset();
}

std::optional<DriveIllegalCommand> DriveUnit::undecided_command() const {
  if (!candidate_ || candidate_->statuses < StatusesNeeded() || candidate_->going_down) return std::nullopt;
  return candidate_->command;
}

// --- status word ------------------------------------------------------------------------------------------------

void DriveUnit::OnStatus(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred) {
  if (!ShowsStatus() && !(by_sdo && drive_->status_word_in.empty())) return;
  status_seen_ = true;
  status_last_ = frame;
  const std::optional<std::uint16_t> before = status_;
  if (before != word) {
    status_ = word;
    status_by_sdo_ = by_sdo;
    // Before any other word, 0 is what unused memory holds.
    if (word == 0 && !last_state_) {
      is_without_state_ = false;
      return;
    }
    const bool warned = before && (*before & kWarningBit) != 0;
    const bool warns = (word & kWarningBit) != 0;
    if (warned != warns) sink_.Publish(DriveWarning{slave_, axis_, frame, word, warns, inferred});
    const std::optional<DriveState> to = drive_->StateOf(word);
    if (to != state_ || !before) OnState(to, frame, inferred);
  }
  if (state_) {
    last_state_seen_ = frame;
    last_state_word_ = word;
  } else {
    CountWithoutState(frame);
  }
  behind_hole_ = false;
  if (expected_count_ > 0 || candidate_) CheckLimits(frame);
}

void DriveUnit::CountWithoutState(const FrameRef& frame) {
  if (!is_without_state_) return;
  ++without_state_.words;
  without_state_.last = frame;
}

void DriveUnit::OnState(std::optional<DriveState> to, const FrameRef& frame, bool inferred) {
  DriveStateChanged change;
  change.slave = slave_;
  change.axis = axis_;
  change.frame = frame;
  change.from = last_state_;
  change.from_last = last_state_seen_.number;
  change.to = to;
  change.word = *status_;
  if (last_state_) change.word_before = last_state_word_;
  change.first_zero = last_was_zero_;
  change.by_sdo = status_by_sdo_;
  change.inferred = inferred;
  if (!behind_hole_) change.settings_since = settings_since_;
  state_ = to;
  is_without_state_ = !to;
  if (!to) {
    without_state_ = {frame, frame, 0, change.word, change.from, change.from_last, inferred};
    sink_.Publish(change);
    return;
  }
  if (last_state_ == to) {
    // Only words without a meaning lay between.
    sink_.Publish(change);
    return;
  }
  const bool enters_fault = IsFault(*to) && !(last_state_ && IsFault(*last_state_));
  if (last_state_) {
    JudgeChange(change);
  } else {
    expected_count_ = 0;
    sink_.Publish(change);
  }
  if (candidate_ && !candidate_->going_down) {
    const std::uint16_t word = candidate_->command.word;
    const bool in_force = control_ && ((*control_ ^ word) & control_mask_) == 0;
    if (Level(*to) >= Rank(word) || (in_force && drive_->Commanded(*to, word, word) != 0)) candidate_.reset();
  }
  last_state_ = to;
  last_was_zero_ = *status_ == 0;
  state_since_ = frame;
  if (enters_fault) OnFault(frame);
  if (!IsFault(*to)) fault_ = {};
}

void DriveUnit::JudgeChange(DriveStateChanged& change) {
  if (*change.to == DriveState::kNotReadyToSwitchOn) {
    change.path.Add(0);
    expected_count_ = 0;
    sink_.Publish(change);
    return;
  }
  if (WasExpected(change)) {
    UseUp(change.path);
    sink_.Publish(change);
    return;
  }
  expected_count_ = 0;
  bool whole = false;
  const std::uint32_t given = GivenSince(last_state_seen_, whole);
  if (const auto path = FindPath(*change.from, *change.to, kOwn | given)) {
    change.path = *path;
    if (const FrameRef command = CommandOf(*path, given); command.seen()) change.command = command;
    UseUp(*path);
    sink_.Publish(change);
    return;
  }
  sink_.Publish(change);
  // From here on nobody commanded what happened.
  const bool in_op = al_.possible().empty() || al_.SettledIn(esc::AlState::OP);
  if (!control_ || !acts_ || !in_op || !whole || change.first_zero || behind_hole_) {
    ++unjudged_;
  } else {
    TellIllegal(change, given);
  }
}

/// The drive goes where it was told to: these steps are awaited no longer.
bool DriveUnit::WasExpected(DriveStateChanged& change) {
  if (expected_count_ == 0 || expected_[0].from != *change.from) return false;
  std::size_t step = 0;
  while (step < expected_count_ && expected_[step].to != *change.to) ++step;
  if (step == expected_count_) return false;
  for (std::size_t i = 0; i <= step; ++i) change.path.Add(expected_[i].number);
  change.command = expected_[step].command;
  if (change.command.has_time && change.frame.has_time) change.reaction = change.frame.time - change.command.time;
  std::move(expected_.begin() + static_cast<std::ptrdiff_t>(step) + 1,
            expected_.begin() + static_cast<std::ptrdiff_t>(expected_count_), expected_.begin());
  expected_count_ -= step + 1;
  expected_since_ = change.frame;
  return true;
}

/// Whose word asked for it: the newest that commands a step which the drive did not have to take anyway.
FrameRef DriveUnit::CommandOf(const DrivePath& path, std::uint32_t given) const {
  const std::size_t kept = std::min(given_count_, given_.size());
  for (std::size_t n = 0; n < kept; ++n) {
    const GivenCommand& command = given_[(given_count_ - 1 - n) % given_.size()];
    for (std::uint8_t i = 0; i < path.count; ++i) {
      const device::DriveTransition* transition = drive_->Find(path.numbers[i]);
      const bool automatic = transition == nullptr || transition->automatic;
      if (!automatic && (command.transitions & given & Bit(path.numbers[i])) != 0) return command.frame;
    }
  }
  return {};
}

void DriveUnit::TellIllegal(const DriveStateChanged& change, std::uint32_t given) {
  DriveIllegalChange illegal;
  illegal.slave = slave_;
  illegal.axis = axis_;
  illegal.frame = change.frame;
  illegal.from = *change.from;
  illegal.to = *change.to;
  illegal.from_last = last_state_seen_.number;
  illegal.word_before = last_state_word_;
  illegal.word = change.word;
  illegal.control = *control_;
  illegal.control_since = control_since_.number;
  illegal.inferred = change.inferred || control_inferred_;
  if (const auto way = FindPath(*change.from, *change.to, ~0U)) {
    for (std::uint8_t i = 0; i < way->count; ++i) {
      if ((Bit(way->numbers[i]) & (kOwn | given)) == 0) illegal.missing.Add(way->numbers[i]);
    }
  }
  sink_.Publish(illegal);
}

/// The drive works its commands off in order: what it has done now was asked for by the first that does, and those
/// before that one are over.
void DriveUnit::UseUp(const DrivePath& path) {
  if (given_count_ > given_.size()) used_up_ = std::max(used_up_, given_count_ - given_.size());
  for (std::uint8_t i = 0; i < path.count; ++i) {
    if ((kOwn & Bit(path.numbers[i])) != 0) continue;
    for (std::size_t n = used_up_; n < given_count_; ++n) {
      if ((given_[n % given_.size()].transitions & Bit(path.numbers[i])) == 0) continue;
      used_up_ = n;
      break;
    }
  }
}

/// Transitions commanded since shortly before the state was last shown, and by the word in force then.
/// @param whole set to false when some of these words may not be known
std::uint32_t DriveUnit::GivenSince(const FrameRef& last, bool& whole) const {
  const std::size_t kept = std::min(given_count_, given_.size());
  const std::int64_t begin = last.time - limits_.reaction_ns;
  std::uint32_t given = 0;
  bool reached = false;  // a word from before the window: nothing older matters
  for (std::size_t n = 0; n < kept && !reached; ++n) {
    const std::size_t number = given_count_ - 1 - n;
    const GivenCommand& command = given_[number % given_.size()];
    given |= command.transitions;
    reached = (used_up_ > 0 && number <= used_up_) ||
              (last.has_time && command.frame.has_time && command.frame.time <= begin);
  }
  whole = reached || (history_whole_ && given_count_ <= given_.size());
  return given;
}

std::optional<DrivePath> DriveUnit::FindPath(DriveState from, DriveState to, std::uint32_t available) const {
  constexpr std::size_t kAllStates = 8;
  std::array<std::optional<DrivePath>, kAllStates> reached;
  std::array<DriveState, kAllStates> queue{};
  std::size_t head = 0;
  std::size_t tail = 0;
  const auto slot = [](DriveState state) { return static_cast<std::size_t>(state) % kAllStates; };
  reached[slot(from)] = DrivePath{};
  queue[tail++] = from;
  while (head < tail) {
    const DriveState state = queue[head++];
    for (const device::DriveTransition& transition : drive_->transitions) {
      if ((available & Bit(transition.number)) == 0 || reached[slot(transition.to)]) continue;
      const bool fits = transition.from ? *transition.from == state
                                        : transition.to == DriveState::kFaultReactionActive && !IsFault(state);
      if (!fits) continue;
      DrivePath path = *reached[slot(state)];
      path.Add(transition.number);
      reached[slot(transition.to)] = path;
      if (transition.to == to) return path;
      queue[tail++] = transition.to;
    }
  }
  return std::nullopt;
}

void DriveUnit::CheckLimits(const FrameRef& frame) {
  if (!acts_ || !ActsOnControl()) {
    expected_count_ = 0;
    candidate_.reset();
    return;
  }
  unsure_ = !SurelyActs();
  if (unsure_) {
    // The drive's time begins when it acts for certain.
    expected_since_ = frame;
    if (candidate_) candidate_->statuses = 0;
    return;
  }
  if (candidate_) {
    ++candidate_->statuses;
    const FrameRef& given = candidate_->command.frame;
    const bool late = frame.has_time && given.has_time && frame.time - given.time > limits_.reaction_ns;
    if (late && !candidate_->going_down) ConfirmCandidate();
  }
  if (expected_count_ == 0 || state_ != expected_[0].from) return;
  if (!frame.has_time || !expected_since_.has_time) {
    without_time_ = true;
    return;
  }
  const Expected& next = expected_[0];
  const std::int64_t limit =
      next.from == DriveState::kOperationEnabled ? limits_.leaving_operation_ns : limits_.reaction_ns;
  const std::int64_t waited = frame.time - expected_since_.time;
  if (waited <= limit) return;
  const device::DriveTransition* transition = drive_->Find(next.number);
  if (transition != nullptr && !transition->optional) {
    const std::int64_t since_command = next.command.has_time ? frame.time - next.command.time : waited;
    sink_.Publish(DriveNoReaction{slave_, axis_, frame, next.command, next.word, next.before, next.number, *state_,
                                  *status_, std::max(waited, since_command), limit, control_inferred_});
  }
  expected_count_ = 0;
}

// --- faults and modes -------------------------------------------------------------------------------------------

void DriveUnit::OnFault(const FrameRef& frame) {
  fault_ = frame;
  if (emergency_) {
    const bool timed = frame.has_time && emergency_frame_.has_time;
    if (!timed || frame.time - emergency_frame_.time <= kEmergencyBeforeFault_ns) {
      Explain(DriveFaultExplained::Source::kEmergency, 0, emergency_->error_code, emergency_frame_);
    }
  }
  if (error_code_ && *error_code_ != 0) {
    Explain(DriveFaultExplained::Source::kErrorCode, error_object_, *error_code_, frame);
  }
}

void DriveUnit::Explain(DriveFaultExplained::Source source, std::uint16_t object, std::uint32_t code,
                        const FrameRef& frame) {
  if (fault_.seen()) sink_.Publish(DriveFaultExplained{slave_, axis_, frame, fault_, source, object, code});
}

void DriveUnit::OnMode(std::int8_t value, bool shown, const FrameRef& frame, bool by_sdo, bool inferred) {
  std::optional<std::int8_t>& known = shown ? mode_shown_ : mode_requested_;
  bool& of_run_before = mode_of_run_before_.at(shown ? 1 : 0);
  if (known == value && !of_run_before) return;
  known = value;
  of_run_before = false;
  if (!shown) settings_since_ = frame;
  sink_.Publish(DriveMode{slave_, axis_, frame, shown, value, by_sdo, inferred});
}

}  // namespace ecaudit::model
