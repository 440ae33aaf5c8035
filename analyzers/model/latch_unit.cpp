#include "analyzers/model/latch_unit.h"

#include <algorithm>
#include <bit>

#include "analyzers/model/process_image.h"

namespace ecaudit::model {
namespace {

using Kind = LatchMisuse::Kind;
using device::LatchEdge;
using device::PdoDirection;

constexpr std::uint16_t kTouchProbeFunction = 0x60B8;
/// Objects that hold latch positions in one family or another (MKD, 4.7).
constexpr std::array<std::uint16_t, 6> kPositionObjects = {0x20A0, 0x20A1, 0x20A2, 0x20A3, 0x20A6, 0x20A7};

/// Which latch edges use the capture unit of a touch probe: 20A0h and 20A1h belong to CAP0, 20A2h and 20A3h to CAP1
/// (MKD, 5.3.3); touch probe 1 is enabled by bit 0 of 60B8h, touch probe 2 by bit 8 (CiA 402).
struct CaptureUnit {
  std::uint16_t latch_enable;
  std::uint16_t probe_enable;
};
constexpr std::array<CaptureUnit, 2> kCaptureUnits = {{{0x0003, 0x0001}, {0x000C, 0x0100}}};

/// Status words that must have come before a missing acknowledge is complained of, at long cycles.
constexpr std::uint32_t kWordsForAcknowledge = 3;
/// Status words after which we say that without time stamps nothing can be judged.
constexpr std::uint32_t kWordsWithoutTime = 20;
/// How long a value may lie unread at the end of the capture before it counts as not read, in ns.
constexpr std::int64_t kUnreadAtEnd = 1'000'000'000;

std::uint16_t Bit(std::size_t n) {
  return static_cast<std::uint16_t>(1U << n);
}

bool Holds(const LatchEdge& edge, std::uint16_t index, std::uint8_t subindex) {
  return std::any_of(edge.positions.begin(), edge.positions.end(), [&](const device::ObjectAddress& object) {
    return object.index == index && object.subindex == subindex;
  });
}

bool IsPosition(std::uint16_t index) {
  return std::find(kPositionObjects.begin(), kPositionObjects.end(), index) != kPositionObjects.end();
}

/// A position object of which this family's manual does not say whose position it holds.
bool IsStray(const device::LatchDescription& latch, std::uint16_t index) {
  return IsPosition(index) && std::none_of(latch.edges.begin(), latch.edges.end(),
                                           [index](const LatchEdge& edge) { return Holds(edge, index, 0); });
}

/// The position that the inputs hold beside a status word which acknowledges the selector of `edge`: in the object that
/// the manual names for this edge, or in the only latch position among them where the manual names no edge for it.
std::optional<std::int64_t> Supplied(const device::LatchDescription& latch, const LatchEdge& edge,
                                     const ProcessCycle& cycle) {
  const ImagePart::Place* own = nullptr;
  const ImagePart::Place* stray = nullptr;
  std::size_t positions = 0;
  for (const ImagePart::Place& place : cycle.part.places) {
    const auto index = static_cast<std::uint16_t>(place.object >> 8U);
    const auto subindex = static_cast<std::uint8_t>(place.object & 0xFFU);
    if (place.bits == 0 || place.bits > 64) continue;
    if (IsPosition(index)) ++positions;
    if (Holds(edge, index, subindex)) own = &place;
    if (IsStray(latch, index)) stray = &place;
  }
  const ImagePart::Place* place = own != nullptr ? own : positions == 1 ? stray : nullptr;
  if (place == nullptr) return std::nullopt;
  return SignExtend(ExtractBits(cycle.data, place->bit, place->bits), place->bits);
}

}  // namespace

std::string_view Name(LatchReading reading) {
  switch (reading) {
    case LatchReading::kNone:
      return "none";
    case LatchReading::kMapped:
      return "mapped object";
    case LatchReading::kSelector:
      return "selector";
    case LatchReading::kSdo:
      return "SDO";
  }
  return "none";
}

std::string_view RuleOf(LatchMisuse::Kind kind) {
  switch (kind) {
    case Kind::kReadBeforeValid:
      return "latch-read-before-valid";
    case Kind::kInvalidSelector:
      return "latch-invalid-selector";
    case Kind::kReservedBits:
      return "latch-reserved-bits";
    case Kind::kRearmWithoutEdge:
      return "latch-rearm-without-edge";
    case Kind::kValueLost:
      return "latch-value-lost";
    case Kind::kAckMismatch:
      return "latch-ack-mismatch";
    case Kind::kNotMapped:
      return "latch-not-mapped";
    case Kind::kOutsideOp:
      return "latch-outside-op";
    case Kind::kTouchProbeConflict:
      return "latch-touch-probe-conflict";
  }
  return "";
}

void LatchUnit::SetFamily(const device::DeviceDescription& family) {
  const auto& words = words_ == Words::kLatch ? family.latch : family.touch_probe;
  const device::LatchDescription* latch = words ? &*words : nullptr;
  if (latch == latch_) return;
  Forget();
  latch_ = latch;
  parts_.clear();
  next_part_ = 0;
  input_masks_ = {};
  enable_mask_ = 0;
  captures_.clear();
  captures_left_out_ = 0;
  edges_.clear();
  if (latch == nullptr) return;
  for (std::size_t n = 0; n < std::min(latch->edges.size(), kMaxEdges); ++n) {
    enable_mask_ = static_cast<std::uint16_t>(enable_mask_ | latch->edges[n].enable);
  }
  for (const device::LatchField& field : latch->status) {
    if (field.input >= 1 && field.input <= kMaxInputs) input_masks_[field.input - 1U] = field.mask;
  }
}

/// The first word came.
void LatchUnit::NeedEdges() {
  if (edges_.empty()) edges_.resize(std::min(latch_->edges.size(), kMaxEdges));
}

void LatchUnit::Forget() {
  control_known_ = status_known_ = probe_known_ = false;
  control_doubt_ = doubt_selector_ = status_gap_ = stray_read_ = false;
  doubt_zero_ = unread_ = conflict_ = 0;
  selection_ = {};
  for (Edge& edge : edges_) {
    edge.enabled = edge.valid = edge.open = edge.stale = edge.doubtful = edge.loss_pending = false;
    edge.kept = kNotKept;
  }
}

std::optional<bool> LatchUnit::input(std::size_t n, std::uint16_t status_word) const {
  if (input_masks_[n] == 0) return std::nullopt;
  return (status_word & input_masks_[n]) != 0;
}

// --- where the words lie ------------------------------------------------------------------------------------------

const LatchUnit::Part& LatchUnit::PartOf(const ImagePart& part) {
  for (const Part& known : parts_) {
    if (known.used && known.serial == part.serial) return known;
  }
  if (parts_.empty()) parts_.resize(kParts);
  Part& learned = parts_[next_part_];
  next_part_ = (next_part_ + 1) % parts_.size();
  learned = {};
  learned.used = true;
  learned.serial = part.serial;
  Learn(learned, part);
  return learned;
}

void LatchUnit::Learn(Part& part, const ImagePart& from) const {
  part.unknown_layout = from.places.empty();
  part.incomplete = from.incomplete;
  for (const ImagePart::Place& place : from.places) {
    const auto index = static_cast<std::uint16_t>(place.object >> 8U);
    const auto subindex = static_cast<std::uint8_t>(place.object & 0xFFU);
    if (place.bits == 0 || place.bits > 64) continue;
    const Where where{place.bit, place.bits};
    if (from.direction == PdoDirection::kRx) {
      if (index == latch_->control_object && subindex == 0) part.control = where;
      if (index == kTouchProbeFunction && subindex == 0) part.probe = where;
      continue;
    }
    if (index == latch_->status_object && subindex == 0) part.status = where;
    if (IsStray(*latch_, index)) part.stray_position = true;
    for (std::size_t n = 0; n < edges_.size(); ++n) {
      if (!Holds(latch_->edges[n], index, subindex)) continue;
      part.positions[n] = where;
      part.any_position = true;
    }
  }
}

Still LatchUnit::OnCycle(const ProcessCycle& cycle, StillCycle& watched) {
  if (latch_ == nullptr) return Still::kIdle;
  const Part& part = PartOf(cycle.part);
  return cycle.part.direction == PdoDirection::kRx ? OnOutputs(cycle, part, watched) : OnInputs(cycle, part, watched);
}

Still LatchUnit::OnOutputs(const ProcessCycle& cycle, const Part& part, StillCycle& watched) {
  if (part.control.bits == 0 && part.probe.bits == 0) return Still::kIdle;
  if (cycle.exchange == Exchange::kNo || !cycle.has_data()) return Still::kNo;
  // Nearly every cycle carries the word of the one before.
  const bool settled = control_known_ && !control_doubt_ && !selection_.undecided && part.probe.bits == 0;
  if (settled && cycle.exchange != Exchange::kUnknown &&
      ExtractBits(cycle.data, part.control.bit, part.control.bits) == control_) {
    cyclic_control_ = true;
    ++control_words_;
    return watched.Watch(cycle.data, part.control.bit, part.control.bits) ? Still::kCounts : Still::kNo;
  }
  const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
  Word word{0, frame, frame.number, frame.number, false, cycle.exchange == Exchange::kInferred};
  const bool taken = cycle.exchange != Exchange::kUnknown;
  if (part.control.bits != 0) {
    word.value = static_cast<std::uint16_t>(ExtractBits(cycle.data, part.control.bit, part.control.bits));
    if (taken) {
      cyclic_control_ = true;
      OnControl(word);
    } else if (control_known_ && word.value != control_) {
      control_doubt_ = true;
      doubt_zero_ = static_cast<std::uint16_t>(doubt_zero_ | ~word.value);
      doubt_selector_ |= latch_->Selector(word.value) != latch_->Selector(control_);
    }
  }
  if (part.probe.bits != 0 && taken) {
    OnProbe(static_cast<std::uint16_t>(ExtractBits(cycle.data, part.probe.bit, part.probe.bits)), word);
  }
  return Still::kNo;
}

Still LatchUnit::OnInputs(const ProcessCycle& cycle, const Part& part, StillCycle& watched) {
  const bool same_kind = unknown_inputs_ == part.unknown_layout;
  unknown_inputs_ = part.unknown_layout;
  // Its status word may have lain between two datagrams, of which one did not come.
  const bool status_missing = part.incomplete && part.status.bits == 0;
  if (status_missing) status_gap_ = true;
  const Still idle = same_kind && !status_missing ? Still::kIdle : Still::kNo;
  if (part.status.bits == 0 && !part.any_position && !part.stray_position) return idle;
  if (!cycle.has_data()) {
    status_gap_ = true;
    return Still::kNo;
  }
  const bool settled = status_known_ && unread_ == 0 && !selection_.undecided &&
                       (!selection_.active || selection_.acknowledged || selection_.judged);
  if (settled && part.status.bits != 0 && ExtractBits(cycle.data, part.status.bit, part.status.bits) == status_) {
    cyclic_status_ = true;
    ++status_words_;
    status_frame_ = cycle.frame();
    status_begun_ = (cycle.sent.seen() ? cycle.sent : cycle.returned).number;
    status_gap_ = false;
    return same_kind && watched.Watch(cycle.data, part.status.bit, part.status.bits) ? Still::kCounts : Still::kNo;
  }
  if (part.status.bits != 0) {
    const FrameRef& begun = cycle.sent.seen() ? cycle.sent : cycle.returned;
    const Word word{static_cast<std::uint16_t>(ExtractBits(cycle.data, part.status.bit, part.status.bits)),
                    cycle.frame(),
                    begun.number,
                    cycle.frame().number,
                    false,
                    cycle.exchange == Exchange::kInferred};
    cyclic_status_ = true;
    if (selection_.undecided && begun.number == selection_.word.begun) {
      Decide((word.value & latch_->edges[selection_.edge].valid) != 0, true);
    }
    // Before the acknowledge an object that several edges share may hold the position of another one.
    Edge* asked = selection_.active && !selection_.acknowledged ? &edges_[selection_.edge] : nullptr;
    const bool acknowledges = asked != nullptr && asked->open && latch_->Acknowledge(word.value) == selection_.selector;
    const std::optional<std::int64_t> before = acknowledges ? asked->capture.position : std::nullopt;
    if (acknowledges) {
      const auto supplied = Supplied(*latch_, latch_->edges[selection_.edge], cycle);
      if (supplied) asked->capture.position = supplied;
    }
    OnStatus(word);
    // It was not the answer to this selector after all.
    if (acknowledges && asked->capture.acknowledged.number != word.frame.number) asked->capture.position = before;
  }
  if (unread_ == 0) return part.status.bits == 0 ? idle : Still::kNo;
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    if ((unread_ & Bit(n)) == 0) continue;
    const Where& where = part.positions[n];
    if (where.bits != 0) {
      ReadBy(n, LatchReading::kMapped, cycle.frame(),
             SignExtend(ExtractBits(cycle.data, where.bit, where.bits), where.bits));
    } else if (part.stray_position) {
      stray_read_ = true;
    }
  }
  return Still::kNo;
}

void LatchUnit::Repeat(const ProcessCycle& cycle) {
  if (cycle.part.direction == PdoDirection::kRx) {
    ++control_words_;
    return;
  }
  ++status_words_;
  status_frame_ = cycle.frame();
  status_begun_ = (cycle.sent.seen() ? cycle.sent : cycle.returned).number;
}

// --- the control word ---------------------------------------------------------------------------------------------

void LatchUnit::OnControl(const Word& word) {
  NeedEdges();
  ++control_words_;
  if (selection_.undecided && word.begun != selection_.word.begun) Decide(false, false);
  if (control_known_ && !control_doubt_ && word.value == control_) return;
  const bool first = !control_known_;
  const std::uint16_t before = first ? std::uint16_t{0} : control_;
  const auto set = static_cast<std::uint16_t>(word.value & ~before);
  last_control_ = word.value;

  const auto reserved = static_cast<std::uint16_t>(set & latch_->reserved_control);
  if (reserved != 0) {
    LatchMisuse misuse = Misuse(Kind::kReservedBits, word);
    misuse.value = reserved;
    Emit(misuse);
  }
  if (!first) JudgeState(word, before);

  const std::uint8_t selector = latch_->Selector(word.value);
  const bool selector_changed = first || selector != latch_->Selector(before) || doubt_selector_;
  if (selector_changed && !first) Deselect(word);
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    const bool now = latch_->edges[n].EnabledBy(word.value);
    Edge& edge = edges_[n];
    if (now && edge.enabled && control_doubt_ && (doubt_zero_ & latch_->edges[n].enable) != 0) edge.doubtful = true;
    if (now == edge.enabled) continue;
    if (now && first) {
      // Enabled before the capture began, or before its first word that the drive took.
      edge.enabled = true;
      if (!edge.open) Open(n);
      Keep(edge);
    } else if (now) {
      Arm(n, word);
    } else {
      Disarm(n, word);
    }
  }
  control_ = word.value;
  if (selector_changed) Select(word, selector);
  control_known_ = true;
  control_doubt_ = doubt_selector_ = false;
  doubt_zero_ = 0;
  JudgeProbe(word);
}

void LatchUnit::JudgeState(const Word& word, std::uint16_t before) {
  const std::uint8_t selector = latch_->Selector(word.value);
  const bool asks = selector != 0 && selector != latch_->Selector(before);
  if ((word.value & ~before & enable_mask_) == 0 && !asks) return;  // what only clears bits is no use of the latch
  const StateSet states = al_.possible();
  if (states.empty()) {
    NotJudged(Kind::kOutsideOp, word.frame, "the AL state of the slave is not known");
    return;
  }
  if (states.contains(static_cast<std::uint8_t>(esc::AlState::OP))) return;
  LatchMisuse misuse = Misuse(Kind::kOutsideOp, word);
  misuse.control_before = before;
  misuse.state = states.single();
  Emit(misuse);
}

/// A read selector was set: may the master ask for this value now?
void LatchUnit::Select(const Word& word, std::uint8_t selector) {
  if (selector == 0) return;
  const LatchEdge* asked = latch_->FindSelector(selector);
  const std::size_t n = asked == nullptr ? kMaxEdges : static_cast<std::size_t>(asked - latch_->edges.data());
  selection_ = {};
  if (n >= edges_.size()) {
    LatchMisuse misuse = Misuse(Kind::kInvalidSelector, word);
    misuse.value = selector;
    Emit(misuse);
    return;
  }
  Edge& edge = edges_[n];
  selection_.active = true;
  selection_.selector = selector;
  selection_.edge = static_cast<std::uint8_t>(n);
  selection_.word = word;
  if (edge.open && !edge.capture.selected.seen()) {
    edge.capture.selected = word.frame;
    Keep(edge);
  }
  if (!control_known_) return;  // set before the capture began, perhaps
  if (edge.open && edge.enabled && edge.released.seen() && edge.valid) {
    if (edge.doubtful) {
      NotJudged(Kind::kRearmWithoutEdge, word.frame,
                "a control word of which it is not known whether the drive took it cleared the enable bit");
    } else {
      LatchMisuse misuse = Misuse(Kind::kRearmWithoutEdge, word);
      misuse.edge = asked;
      misuse.value = selector;
      misuse.capture = edge.capture;
      misuse.related = {edge.capture.armed.number, edge.capture.valid.number, edge.capture.acknowledged.number,
                        edge.released.number};
      Emit(misuse);
    }
  }
  if (status_known_ && edge.valid) {
    selection_.expects_ack = true;
    return;
  }
  selection_.status_known = status_known_;
  selection_.status_gap = status_gap_;
  // The status word of the same frame is older than the selector: it may show the valid bit in time.
  if (!word.by_sdo && (cyclic_status_ || status_words_ == 0)) {
    selection_.undecided = true;
  } else {
    Decide(false, false);
  }
}

void LatchUnit::Decide(bool valid_in_same_frame, bool same_frame_known) {
  selection_.undecided = false;
  if (same_frame_known && valid_in_same_frame) {
    selection_.expects_ack = true;
    return;
  }
  const Word& word = selection_.word;
  if (!same_frame_known && !selection_.status_known) {
    NotJudged(Kind::kReadBeforeValid, word.frame, "the latch status word before the selector is not in the capture");
    return;
  }
  if (!same_frame_known && selection_.status_gap) {
    NotJudged(Kind::kReadBeforeValid, word.frame, "inputs are missing just before the selector was set");
    return;
  }
  LatchMisuse misuse = Misuse(Kind::kReadBeforeValid, word);
  misuse.edge = &latch_->edges[selection_.edge];
  misuse.value = selection_.selector;
  const Edge& edge = edges_[selection_.edge];
  if (edge.open) misuse.capture = edge.capture;
  misuse.related = {edge.open ? edge.capture.armed.number : 0, status_known_ ? status_frame_.number : 0, 0, 0};
  Emit(misuse);
}

/// The selector leaves what it asked for.
void LatchUnit::Deselect(const Word& word) {
  if (!selection_.active) return;
  selection_.dropped = true;
  Edge& edge = edges_[selection_.edge];
  const bool held = latch_->edges[selection_.edge].EnabledBy(word.value);
  if (latch_->Selector(word.value) == 0 && edge.open && held && edge.capture.acknowledged.seen()) {
    edge.released = word.frame;
  }
}

void LatchUnit::Open(std::size_t n) {
  Edge& edge = edges_[n];
  edge.capture = {};
  edge.capture.edge = static_cast<std::uint8_t>(n);
  edge.open = true;
  edge.stale = edge.doubtful = edge.loss_pending = false;
  edge.released = {};
  edge.armed_done = 0;
  unread_ = static_cast<std::uint16_t>(unread_ & ~Bit(n));
  if (captures_.size() < kMaxCaptures && TakeFrom(allowance_, 1)) {
    edge.kept = captures_.size();
    captures_.push_back(edge.capture);
  } else {
    edge.kept = kNotKept;
    ++captures_left_out_;
  }
}

void LatchUnit::Keep(const Edge& edge) {
  if (edge.kept != kNotKept) captures_[edge.kept] = edge.capture;
}

void LatchUnit::Arm(std::size_t n, const Word& word) {
  Edge& edge = edges_[n];
  if (edge.open && edge.loss_pending) Lose(n);
  const bool again = edge.history.armed > 0;
  if (edge.kept != kNotKept) captures_[edge.kept].rearmed = word.frame;
  if (selection_.dropped && selection_.edge == n) selection_ = {};  // an acknowledge that stays is of old
  Open(n);
  edge.enabled = true;
  edge.stale = edge.valid;
  edge.armed_done = word.done;
  edge.capture.armed = word.frame;
  edge.capture.assumed = word.inferred;
  ++edge.history.armed;
  Keep(edge);
  Step(again ? LatchStep::Kind::kRearmed : LatchStep::Kind::kArmed, n, word.frame);
}

void LatchUnit::Disarm(std::size_t n, const Word& word) {
  Edge& edge = edges_[n];
  edge.enabled = false;
  if (!edge.open) return;
  edge.capture.disarmed = word.frame;
  edge.disarmed_done = word.done;
  Keep(edge);
  Step(LatchStep::Kind::kDisarmed, n, word.frame);
  const LatchCapture& capture = edge.capture;
  // A value that the master had not heard of when it sent this word is none that it forgot.
  if (capture.valid.seen() && !capture.read.seen() && !capture.valid_before && capture.valid.number < word.begun) {
    edge.loss_pending = true;
    return;
  }
  if (capture.valid.seen() && !capture.read.seen() && capture.valid_before) {
    NotJudged(Kind::kValueLost, word.frame, "the valid bit was set before the capture began");
  }
  if (edge.stale) NotJudged(Kind::kValueLost, word.frame, "the valid bit did not fall when the edge was armed again");
  edge.open = false;
  unread_ = static_cast<std::uint16_t>(unread_ & ~Bit(n));
}

void LatchUnit::ReadBy(std::size_t n, LatchReading reading, const FrameRef& frame,
                       std::optional<std::int64_t> position) {
  Edge& edge = edges_[n];
  if (!edge.open || edge.capture.read.seen()) return;
  edge.capture.read = frame;
  edge.capture.reading = reading;
  if (position) edge.capture.position = position;
  edge.loss_pending = false;
  ++edge.history.read;
  unread_ = static_cast<std::uint16_t>(unread_ & ~Bit(n));
  Keep(edge);
  Step(LatchStep::Kind::kRead, n, frame);
  if (!edge.enabled) edge.open = false;
}

void LatchUnit::Lose(std::size_t n) {
  Edge& edge = edges_[n];
  edge.loss_pending = edge.open = false;
  ++edge.history.lost;
  unread_ = static_cast<std::uint16_t>(unread_ & ~Bit(n));
  if (!edge.history.first_unread.valid.seen()) edge.history.first_unread = edge.capture;
  const FrameRef& frame = edge.capture.disarmed;
  if (unknown_inputs_) {
    NotJudged(Kind::kValueLost, frame, "what the inputs hold is not known, so the position may be among them");
    return;
  }
  if (stray_read_) {
    NotJudged(Kind::kValueLost, frame, "the manual does not say which edge the position belongs to that was read");
    return;
  }
  LatchMisuse misuse = Misuse(Kind::kValueLost, {control_, frame, 0, 0, !cyclic_control_, edge.capture.assumed});
  misuse.edge = &latch_->edges[n];
  misuse.capture = edge.capture;
  misuse.related = {edge.capture.armed.number, edge.capture.valid.number, edge.capture.selected.number, 0};
  Emit(misuse);
}

// --- the status word ----------------------------------------------------------------------------------------------

void LatchUnit::OnStatus(const Word& word) {
  NeedEdges();
  ++status_words_;
  const bool awaits = selection_.active && !selection_.acknowledged && !selection_.judged;
  if (status_known_ && word.value == status_ && !awaits) {
    status_frame_ = word.frame;
    status_begun_ = word.begun;
    status_gap_ = false;
    return;
  }
  const bool first = !status_known_;
  const auto changed = static_cast<std::uint16_t>(first ? 0 : word.value ^ status_);
  for (std::size_t i = 0; i < kMaxInputs; ++i) input_changes_[i] += (changed & input_masks_[i]) != 0 ? 1U : 0U;
  status_known_ = true;
  status_ = word.value;
  last_status_ = word.value;
  status_frame_ = word.frame;
  status_begun_ = word.begun;
  status_gap_ = false;

  for (std::size_t n = 0; n < edges_.size(); ++n) {
    Edge& edge = edges_[n];
    if ((word.value & latch_->edges[n].valid) == 0 || edge.valid) continue;
    edge.valid = true;
    const bool arming_seen = edge.open && edge.capture.armed.seen();
    if (!edge.open && !first) continue;  // after the enable bit was cleared: nobody waits for it any more
    if (!edge.open) Open(n);
    if (arming_seen && word.begun <= edge.armed_done) {
      edge.stale = true;
      continue;
    }
    edge.capture.valid = word.frame;
    edge.capture.valid_before = first && !arming_seen;
    ++edge.history.valid;
    unread_ = static_cast<std::uint16_t>(unread_ | Bit(n));
    LearnMapping(edge, n);
    Keep(edge);
    if (!edge.capture.valid_before) Step(LatchStep::Kind::kValid, n, word.frame);
  }
  if (awaits || selection_.active) JudgeAcknowledge(word);
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    Edge& edge = edges_[n];
    if ((word.value & latch_->edges[n].valid) != 0 || !edge.valid) continue;
    edge.valid = edge.stale = false;
    if (!edge.open || !edge.capture.valid.seen()) continue;
    if (edge.loss_pending && word.begun > edge.disarmed_done) Lose(n);
    edge.loss_pending = edge.open = false;
    unread_ = static_cast<std::uint16_t>(unread_ & ~Bit(n));
    if (edge.enabled) Open(n);  // the drive itself waits for the next edge
  }
}

void LatchUnit::JudgeAcknowledge(const Word& word) {
  Selection& asked = selection_;
  if (word.begun <= asked.word.done) return;  // older than the selector
  ++asked.words;
  const LatchEdge& latch_edge = latch_->edges[asked.edge];
  Edge& edge = edges_[asked.edge];
  if (latch_->Acknowledge(word.value) == asked.selector) {
    asked.acknowledged = true;
    if (edge.open && edge.capture.valid.seen() && !edge.capture.acknowledged.seen() &&
        ((word.value & latch_edge.valid) != 0 || edge.loss_pending)) {
      edge.capture.acknowledged = word.frame;
      Keep(edge);
      ReadBy(asked.edge, LatchReading::kSelector, word.frame, std::nullopt);
    }
    return;
  }
  if (!asked.expects_ack || asked.acknowledged || asked.judged || asked.dropped) return;
  if (!asked.word.frame.has_time || !word.frame.has_time) {
    if (asked.words < kWordsWithoutTime) return;
    asked.judged = true;
    NotJudged(Kind::kAckMismatch, word.frame, "the frames have no time stamps");
    return;
  }
  const std::int64_t waited = word.frame.time - asked.word.frame.time;
  if (waited <= ack_limit_ns_ || (!word.by_sdo && asked.words < kWordsForAcknowledge)) return;
  asked.judged = true;
  LatchMisuse misuse = Misuse(Kind::kAckMismatch, word);
  misuse.edge = &latch_edge;
  misuse.control = control_;
  misuse.value = asked.selector;
  misuse.waited_ns = waited;
  misuse.limit_ns = ack_limit_ns_;
  misuse.capture = edge.capture;
  misuse.related = {asked.word.frame.number, edge.capture.valid.number, 0, 0};
  misuse.inferred = word.inferred || asked.word.inferred;
  Emit(misuse);
}

void LatchUnit::LearnMapping(Edge& edge, std::size_t n) const {
  using Mapping = LatchEdgeHistory::Mapping;
  const std::vector<device::ObjectAddress>& positions = latch_->edges[n].positions;
  if (positions.empty()) {
    edge.history.mapping = Mapping::kUndocumented;
    return;
  }
  const ProcessLayout& inputs = process_.tx();
  if (!inputs.known()) {
    edge.history.mapping = Mapping::kUnknown;
    return;
  }
  const bool mapped = std::any_of(positions.begin(), positions.end(), [&](const device::ObjectAddress& object) {
    return inputs.Find(object.index, object.subindex) != nullptr;
  });
  const bool stray = std::any_of(inputs.signals.begin(), inputs.signals.end(),
                                 [this](const Signal& signal) { return IsStray(*latch_, signal.index); });
  edge.history.mapping = mapped ? Mapping::kMapped : stray ? Mapping::kUndocumented : Mapping::kNotMapped;
}

// --- touch probe --------------------------------------------------------------------------------------------------

void LatchUnit::OnProbe(std::uint16_t value, const Word& word) {
  if (probe_known_ && value == probe_) return;
  probe_known_ = true;
  probe_ = value;
  JudgeProbe(word);
}

void LatchUnit::JudgeProbe(const Word& word) {
  if (!control_known_ || !probe_known_) return;
  std::uint16_t conflict = 0;
  for (std::size_t unit = 0; unit < kCaptureUnits.size(); ++unit) {
    const CaptureUnit& bits = kCaptureUnits[unit];
    if ((control_ & bits.latch_enable) != 0 && (probe_ & bits.probe_enable) != 0) {
      conflict = static_cast<std::uint16_t>(conflict | Bit(unit));
    }
  }
  const auto appeared = static_cast<std::uint16_t>(conflict & ~conflict_);
  conflict_ = conflict;
  for (std::size_t unit = 0; unit < kCaptureUnits.size(); ++unit) {
    if ((appeared & Bit(unit)) == 0) continue;
    LatchMisuse misuse = Misuse(Kind::kTouchProbeConflict, word);
    misuse.control = control_;
    misuse.value = probe_;
    for (std::size_t n = 0; n < edges_.size(); ++n) {
      const LatchEdge& edge = latch_->edges[n];
      if (misuse.edge == nullptr && (edge.enable & control_ & kCaptureUnits[unit].latch_enable) != 0) {
        misuse.edge = &edge;
        misuse.capture = edges_[n].capture;
        misuse.related[0] = edges_[n].capture.armed.number;
      }
    }
    Emit(misuse);
  }
}

// --- SDO ----------------------------------------------------------------------------------------------------------

void LatchUnit::OnSdo(const mailbox::SdoTransfer& transfer) {
  if (latch_ == nullptr || !transfer.has_object || transfer.complete_access || transfer.data.empty()) return;
  const bool assumed = transfer.outcome == mailbox::SdoOutcome::kNotCaptured;
  if (transfer.outcome != mailbox::SdoOutcome::kCompleted && !assumed) return;
  const std::uint64_t value = UnsignedOf(transfer.data);
  const bool word_object = transfer.subindex == 0 && transfer.data.size() <= 2;
  const FrameRef& request = transfer.request.seen() ? transfer.request : transfer.response;
  const FrameRef& response = transfer.response.seen() ? transfer.response : request;

  if (transfer.service == mailbox::SdoService::kDownload && word_object) {
    const Word word{static_cast<std::uint16_t>(value), request, request.number, response.number, true, assumed};
    if (transfer.index == latch_->control_object && !cyclic_control_) OnControl(word);
    if (transfer.index == kTouchProbeFunction) OnProbe(word.value, word);
    return;
  }
  if (transfer.service != mailbox::SdoService::kUpload || assumed) return;
  if (transfer.index == latch_->status_object && word_object && !cyclic_status_) {
    OnStatus({static_cast<std::uint16_t>(value), response, request.number, response.number, true, false});
    return;
  }
  if (transfer.index == latch_->control_object && word_object && !control_known_) {
    // What the drive reports is nobody's mistake; it only tells where things stand.
    NeedEdges();
    control_known_ = true;
    control_ = static_cast<std::uint16_t>(value);
    last_control_ = control_;
    for (std::size_t n = 0; n < edges_.size(); ++n) {
      if (!latch_->edges[n].EnabledBy(control_)) continue;
      edges_[n].enabled = true;
      if (!edges_[n].open) Open(n);
    }
    return;
  }
  if (unread_ == 0) return;
  const auto bits = static_cast<unsigned>(std::min<std::size_t>(transfer.data.size(), 8) * 8);
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    if ((unread_ & Bit(n)) == 0) continue;
    if (Holds(latch_->edges[n], transfer.index, transfer.subindex)) {
      ReadBy(n, LatchReading::kSdo, response, SignExtend(value, bits));
    } else if (IsStray(*latch_, transfer.index)) {
      stray_read_ = true;
    }
  }
}

// --- the end ------------------------------------------------------------------------------------------------------

void LatchUnit::Finish() {
  if (latch_ == nullptr) return;
  if (selection_.undecided) Decide(false, false);
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    Edge& edge = edges_[n];
    // Words by SDO: nobody looked at the status again, so the master does not know either whether the value is still
    // there. In process data the last status word shows that it is.
    if (edge.open && edge.loss_pending && !cyclic_status_ && status_begun_ <= edge.disarmed_done) Lose(n);
    const LatchCapture& capture = edge.capture;
    const bool lies_unread = edge.open && capture.valid.seen() && !capture.read.seen() && !capture.valid_before &&
                             capture.valid.has_time && status_frame_.has_time &&
                             status_frame_.time - capture.valid.time > kUnreadAtEnd;
    if (lies_unread && !edge.history.first_unread.valid.seen()) edge.history.first_unread = capture;
    const LatchCapture& unread = edge.history.first_unread;
    if (!unread.valid.seen() || edge.history.read > 0) continue;
    const FrameRef& frame = unread.armed.seen() ? unread.armed : unread.valid;
    switch (edge.history.mapping) {
      case LatchEdgeHistory::Mapping::kMapped:
        break;
      case LatchEdgeHistory::Mapping::kUnknown:
        NotJudged(Kind::kNotMapped, frame, "what the inputs hold is not known");
        break;
      case LatchEdgeHistory::Mapping::kUndocumented:
        NotJudged(Kind::kNotMapped, frame, "the manual does not say which object holds the position of this edge");
        break;
      case LatchEdgeHistory::Mapping::kNotMapped: {
        LatchMisuse misuse = Misuse(Kind::kNotMapped, {control_, frame, 0, 0, !cyclic_control_, unread.assumed});
        misuse.edge = &latch_->edges[n];
        misuse.capture = unread;
        misuse.related = {unread.valid.number, unread.disarmed.number, 0, 0};
        Emit(misuse);
        break;
      }
    }
  }
}

// --- events -------------------------------------------------------------------------------------------------------

void LatchUnit::Step(LatchStep::Kind kind, std::size_t n, const FrameRef& frame) {
  LatchStep step;
  step.slave = slave_;
  step.kind = kind;
  step.frame = frame;
  step.edge = &latch_->edges[n];
  step.control = last_control_.value_or(0);
  step.status = last_status_;
  step.capture = edges_[n].capture;
  sink_.Publish(step);
}

LatchMisuse LatchUnit::Misuse(LatchMisuse::Kind kind, const Word& word) const {
  LatchMisuse misuse;
  misuse.kind = kind;
  misuse.slave = slave_;
  misuse.frame = word.frame;
  misuse.control = word.value;
  misuse.status = last_status_;
  misuse.by_sdo = word.by_sdo;
  misuse.inferred = word.inferred;
  return misuse;
}

void LatchUnit::Emit(const LatchMisuse& misuse) {
  if (words_ == Words::kTouchProbe) return;
  ++misuses_;
  sink_.Publish(misuse);
}

void LatchUnit::NotJudged(LatchMisuse::Kind kind, const FrameRef& frame, std::string_view reason) {
  if (words_ == Words::kTouchProbe) return;
  sink_.Publish(LatchNotJudged{kind, slave_, frame, reason});
}

}  // namespace ecaudit::model
