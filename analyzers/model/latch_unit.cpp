#include "analyzers/model/latch_unit.h"

#include <algorithm>

#include "analyzers/model/process_image.h"

namespace ecaudit::model {
namespace {

using Kind = LatchMisuse::Kind;
using Why = LatchNotEvaluable::Why;

std::uint16_t WordAt(const ProcessCycle& cycle, const LatchPart::Where& where) {
  return static_cast<std::uint16_t>(ExtractBits(cycle.data, where.bit, where.bits));
}

FrameNo Begun(const ProcessCycle& cycle) {
  return (cycle.sent.seen() ? cycle.sent : cycle.returned).number;
}

}  // namespace

void LatchUnit::SetFamily(const device::DeviceDescription& family) {
  const auto& words = words_ == Words::kLatch ? family.latch : family.touch_probe;
  const device::LatchDescription* latch = words ? &*words : nullptr;
  if (latch == latch_) return;
  Forget();
  latch_ = latch;
  places_.Forget();
  idle_ = {};
  edges_.SetFamily(latch);
  selector_.SetFamily(latch);
  probe_.SetFamily(latch);
  unasked_.SetFamily(latch);
  input_masks_ = {};
  enable_mask_ = 0;
  if (latch == nullptr) return;
  for (std::size_t n = 0; n < std::min(latch->edges.size(), kMaxLatchEdges); ++n) {
    enable_mask_ = static_cast<std::uint16_t>(enable_mask_ | latch->edges[n].enable);
  }
  for (const device::LatchField& field : latch->status) {
    if (field.input >= 1 && field.input <= kMaxInputs) input_masks_[field.input - 1U] = field.mask;
  }
}

void LatchUnit::Forget() {
  control_.Forget();
  status_.Forget();
  probe_.Forget();
  selector_.Forget();
  edges_.Forget();
  unasked_.Forget();
}

void LatchUnit::ForgetAtGap(const FrameRef& frame) {
  edges_.ForgetAtGap(frame);
  Forget();
}

std::optional<bool> LatchUnit::input(std::size_t n, std::uint16_t status_word) const {
  if (input_masks_[n] == 0) return std::nullopt;
  return (status_word & input_masks_[n]) != 0;
}

// --- process data -------------------------------------------------------------------------------------------------

/// Another part than the last one of its direction.
[[gnu::noinline]] const LatchPart& LatchUnit::Turn(const ImagePart& image) {
  const LatchPart& part = places_.Of(image, *latch_, edges_.size());
  idle_[image.direction == device::PdoDirection::kTx ? 1 : 0] = part.idle() ? image.serial : 0;
  return part;
}

void LatchUnit::OnCycle(const ProcessCycle& cycle) {
  const bool inputs = cycle.part.direction == device::PdoDirection::kTx;
  const LatchPart* last = places_.Last(cycle.part.serial, inputs);
  const LatchPart& part = last != nullptr ? *last : Turn(cycle.part);
  if (inputs) {
    OnInputs(cycle, part);
  } else if (part.control.bits != 0 || part.probe.bits != 0) {
    OnOutputs(cycle, part);
  }
}

[[gnu::always_inline]] inline void LatchUnit::OnOutputs(const ProcessCycle& cycle, const LatchPart& part) {
  if (!cycle.has_data()) return;
  if (cycle.exchange == Exchange::kNo) return NoteSent(cycle, part);
  // Nearly every cycle carries the word of the one before.
  const bool settled = control_.known && !control_.doubt && !selector_.undecided() && part.probe.bits == 0;
  if (settled && cycle.exchange != Exchange::kUnknown &&
      ExtractBits(cycle.data, part.control.bit, part.control.bits) == control_.value) {
    control_.cyclic = true;
    control_.frame = cycle.frame();
    ++control_.words;
  } else {
    TakeOutputs(cycle, part);
  }
}

/// The drive may have accepted the outputs though the working counter does not show it: another slave counted less.
void LatchUnit::NoteSent(const ProcessCycle& cycle, const LatchPart& part) {
  const FrameNo frame = Begun(cycle);
  if (part.control.bits != 0) unasked_.OnControl(WordAt(cycle, part.control), frame);
  if (part.probe.bits != 0) unasked_.OnProbe(WordAt(cycle, part.probe), frame);
}

void LatchUnit::TakeOutputs(const ProcessCycle& cycle, const LatchPart& part) {
  const FrameRef& frame = cycle.sent.seen() ? cycle.sent : cycle.returned;
  LatchWord word{0, frame, frame.number, frame.number, false, cycle.exchange == Exchange::kInferred};
  const bool taken = cycle.exchange != Exchange::kUnknown;
  NoteSent(cycle, part);
  if (part.control.bits != 0) {
    word.value = WordAt(cycle, part.control);
    if (taken) {
      control_.cyclic = true;
      OnControl(word);
    } else {
      Doubt(word.value);
    }
  }
  if (part.probe.bits != 0 && taken) probe_.OnProbe(WordAt(cycle, part.probe), word);
}

[[gnu::always_inline]] inline void LatchUnit::OnInputs(const ProcessCycle& cycle, const LatchPart& part) {
  edges_.InputsUnknown(part.unknown_layout);
  // Its status word may have lain between two datagrams, of which one did not come.
  if (part.incomplete && part.status.bits == 0) status_.gap = true;
  if (part.status.bits == 0 && !part.any_position && !part.stray_position) return;
  if (!cycle.has_data()) {
    status_.gap = true;
    return;
  }
  const bool settled = status_.known && !edges_.any_unread() && !selector_.undecided() && !selector_.awaits();
  if (settled && part.status.bits != 0 && ExtractBits(cycle.data, part.status.bit, part.status.bits) == status_.value) {
    status_.cyclic = true;
    ++status_.words;
    status_.Seen(cycle.frame(), Begun(cycle));
    return;
  }
  TakeInputs(cycle, part);
}

void LatchUnit::TakeInputs(const ProcessCycle& cycle, const LatchPart& part) {
  if (part.status.bits != 0) OnCyclicStatus(cycle, part);
  if (edges_.any_unread()) ReadPositions(cycle, part);
}

void LatchUnit::OnCyclicStatus(const ProcessCycle& cycle, const LatchPart& part) {
  const LatchWord word{WordAt(cycle, part.status), cycle.frame(), Begun(cycle),
                       cycle.frame().number,       false,         cycle.exchange == Exchange::kInferred};
  status_.cyclic = true;
  selector_.OnCyclicStatus(word);
  // Before the acknowledge an object that several edges share may hold the position of another one.
  const std::size_t n = selector_.edge();
  const bool acknowledges = selector_.AcknowledgedBy(word.value) && edges_[n].open;
  const std::optional<std::int64_t> before = acknowledges ? edges_[n].capture.position : std::nullopt;
  if (acknowledges) {
    const auto supplied = LatchPlaces::Supplied(*latch_, latch_->edges[n], cycle);
    if (supplied) edges_.SetPosition(n, supplied);
  }
  OnStatus(word);
  // It was not the answer to this selector after all.
  if (acknowledges && edges_[n].capture.acknowledged.number != word.frame.number) edges_.SetPosition(n, before);
}

void LatchUnit::ReadPositions(const ProcessCycle& cycle, const LatchPart& part) {
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    if (!edges_.unread(n)) continue;
    const LatchPart::Where& where = part.positions[n];
    if (where.bits != 0) {
      edges_.ReadBy(n, LatchReading::kMapped, cycle.frame(),
                    SignExtend(ExtractBits(cycle.data, where.bit, where.bits), where.bits));
    } else if (part.stray_position) {
      edges_.ReadStray();
    }
  }
}

// --- the control word ---------------------------------------------------------------------------------------------

void LatchUnit::OnControl(const LatchWord& word) {
  edges_.Need();
  control_.frame = word.frame;
  ++control_.words;
  selector_.OnControl(word);
  if (control_.known && !control_.doubt && word.value == control_.value) return;
  const bool first = !control_.known;
  const std::uint16_t before = first ? std::uint16_t{0} : control_.value;
  report_.SawControl(word.value);

  const auto reserved = static_cast<std::uint16_t>(word.value & ~before & latch_->reserved_control);
  if (reserved != 0) {
    LatchMisuse misuse = report_.Misuse(Kind::kReservedBits, word);
    misuse.value = reserved;
    report_.Emit(misuse);
  }
  if (!first) CheckState(word, before);

  const std::uint8_t selector = latch_->Selector(word.value);
  const bool selector_changed = first || selector != latch_->Selector(before) || control_.doubt_selector;
  if (selector_changed && !first) selector_.Deselect(word);
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    const bool enabled = latch_->edges[n].EnabledBy(word.value);
    if (enabled && !edges_[n].enabled && !first) selector_.Armed(n);
    edges_.OnEnable(n, enabled, word, first);
  }
  control_.value = word.value;
  if (selector_changed) selector_.Select(word, selector);
  control_.known = true;
  control_.EndDoubt();
  probe_.Check(word);
}

/// A word came of which it is not known whether the drive took it.
void LatchUnit::Doubt(std::uint16_t value) {
  if (!control_.known || value == control_.value) return;
  control_.doubt = true;
  control_.doubt_zero = static_cast<std::uint16_t>(control_.doubt_zero | ~value);
  control_.doubt_selector |= latch_->Selector(value) != latch_->Selector(control_.value);
}

void LatchUnit::CheckState(const LatchWord& word, std::uint16_t before) {
  const std::uint8_t selector = latch_->Selector(word.value);
  const bool asks = selector != 0 && selector != latch_->Selector(before);
  if ((word.value & ~before & enable_mask_) == 0 && !asks) return;  // what only clears bits is no use of the latch
  const StateSet states = al_.possible();
  if (states.empty()) {
    report_.NotEvaluable(Kind::kOutsideOp, word.frame, Why::kAlStateUnknown);
    return;
  }
  if (states.contains(static_cast<std::uint8_t>(esc::AlState::OP))) return;
  LatchMisuse misuse = report_.Misuse(Kind::kOutsideOp, word);
  misuse.control_before = before;
  misuse.state = states.single();
  report_.Emit(misuse);
}

// --- the status word ----------------------------------------------------------------------------------------------

void LatchUnit::OnStatus(const LatchWord& word) {
  edges_.Need();
  ++status_.words;
  if (status_.known && word.value == status_.value && !selector_.awaits()) {
    status_.Seen(word.frame, word.begun);
    return;
  }
  const bool first = !status_.known;
  const auto changed = static_cast<std::uint16_t>(first ? 0 : word.value ^ status_.value);
  for (std::size_t i = 0; i < kMaxInputs; ++i) input_changes_[i] += (changed & input_masks_[i]) != 0 ? 1U : 0U;
  status_.known = true;
  status_.value = word.value;
  status_.Seen(word.frame, word.begun);
  report_.SawStatus(word.value);

  unasked_.OnStatus(word, first, changed);
  edges_.OnValid(word, first);
  selector_.OnStatus(word);
  edges_.OnInvalid(word);
}

// --- SDO ----------------------------------------------------------------------------------------------------------

void LatchUnit::OnSdo(const mailbox::SdoTransfer& transfer) {
  if (latch_ != nullptr && transfer.duration && transfer.answered) edges_.Answered(*transfer.duration);
  if (latch_ == nullptr || !transfer.has_object || transfer.complete_access || transfer.data.empty()) return;
  const bool is_word = transfer.subindex == 0 && transfer.data.size() <= 2;
  if (transfer.service == mailbox::SdoService::kDownload && is_word) {
    // Accepted or not.
    const auto word = static_cast<std::uint16_t>(UnsignedOf(transfer.data));
    const FrameNo frame = (transfer.request.seen() ? transfer.request : transfer.response).number;
    if (transfer.index == latch_->control_object) unasked_.OnControl(word, frame);
    if (transfer.index == LatchPlaces::kTouchProbeFunction) unasked_.OnProbe(word, frame);
  }
  const bool assumed = transfer.outcome == mailbox::SdoOutcome::kNotCaptured;
  if (transfer.outcome != mailbox::SdoOutcome::kCompleted && !assumed) return;
  const std::uint64_t value = UnsignedOf(transfer.data);
  if (transfer.service == mailbox::SdoService::kDownload && is_word) {
    const FrameRef& request = transfer.request.seen() ? transfer.request : transfer.response;
    const FrameRef& response = transfer.response.seen() ? transfer.response : request;
    const LatchWord word{static_cast<std::uint16_t>(value), request, request.number, response.number, true, assumed};
    if (transfer.index == latch_->control_object && !control_.cyclic) OnControl(word);
    if (transfer.index == LatchPlaces::kTouchProbeFunction) probe_.OnProbe(word.value, word);
  } else if (transfer.service == mailbox::SdoService::kUpload && !assumed) {
    OnUpload(transfer, value);
  }
}

void LatchUnit::OnUpload(const mailbox::SdoTransfer& transfer, std::uint64_t value) {
  const bool word_object = transfer.subindex == 0 && transfer.data.size() <= 2;
  const FrameRef& request = transfer.request.seen() ? transfer.request : transfer.response;
  const FrameRef& response = transfer.response.seen() ? transfer.response : request;
  const auto word = static_cast<std::uint16_t>(value);
  if (transfer.index == latch_->status_object || LatchPlaces::IsStray(*latch_, transfer.index) ||
      std::any_of(latch_->edges.begin(), latch_->edges.end(), [&](const device::LatchEdge& edge) {
        return LatchPlaces::Holds(edge, transfer.index, transfer.subindex);
      })) {
    edges_.Asked();
  }
  if (transfer.index == latch_->status_object && word_object && !status_.cyclic) {
    OnStatus({word, response, request.number, response.number, true, false});
    return;
  }
  if (transfer.index == LatchPlaces::kTouchProbeFunction && word_object) unasked_.OnProbe(word, request.number);
  if (transfer.index == latch_->control_object && word_object) unasked_.OnControl(word, request.number);
  if (transfer.index == latch_->control_object && word_object && !control_.known) {
    // What the drive reports is no mistake of the master; it only shows the state.
    edges_.Need();
    control_.known = true;
    control_.value = word;
    report_.SawControl(word);
    for (std::size_t n = 0; n < edges_.size(); ++n) {
      if (latch_->edges[n].EnabledBy(word)) edges_.FoundEnabled(n);
    }
    return;
  }
  const auto bits = static_cast<unsigned>(std::min<std::size_t>(transfer.data.size(), 8) * 8);
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    if (!edges_.unread(n)) continue;
    if (LatchPlaces::Holds(latch_->edges[n], transfer.index, transfer.subindex)) {
      edges_.ReadBy(n, LatchReading::kSdo, response, SignExtend(value, bits));
    } else if (LatchPlaces::IsStray(*latch_, transfer.index)) {
      edges_.ReadStray();
    }
  }
}

void LatchUnit::Finish() {
  if (latch_ == nullptr) return;
  selector_.Finish();
  unasked_.Finish();
  for (std::size_t n = 0; n < edges_.size(); ++n) edges_.Finish(n, status_);
}

}  // namespace ecaudit::model
