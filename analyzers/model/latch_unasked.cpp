#include "analyzers/model/latch_unasked.h"

#include <algorithm>

#include "analyzers/model/probe_conflict.h"

namespace ecaudit::model {
namespace {

using StatusBits = LatchMisuse::StatusBits;

std::uint32_t SelectorBit(std::uint16_t selector) {
  return std::uint32_t{1} << std::min<unsigned>(selector, 31U);
}

}  // namespace

void LatchUnasked::SetFamily(const device::LatchDescription* latch) {
  latch_ = latch;
  held_.clear();
}

void LatchUnasked::Forget() {
  armed_ = probed_ = 0;
  selected_ = 0;
  gap_ = false;
}

void LatchUnasked::OnGap(FrameNo frame) {
  gap_ = true;
  for (Occasion& held : held_) held.gap |= held.first.frame.number >= frame;
}

void LatchUnasked::OnControl(std::uint16_t word, FrameNo frame) {
  armed_ = static_cast<std::uint16_t>(armed_ | word);
  selected_ |= SelectorBit(latch_->Selector(word));
  if (!held_.empty()) DropWhatWasAskedFor(frame);
}

void LatchUnasked::OnProbe(std::uint16_t value, FrameNo frame) {
  probed_ = static_cast<std::uint16_t>(probed_ | value);
  if (!held_.empty()) DropWhatWasAskedFor(frame);
}

bool LatchUnasked::Armed(const device::LatchEdge& edge) const {
  if ((armed_ & edge.enable) == edge.enable) return true;
  // The touch probe that uses the same capture unit may arm it.
  const unsigned probe = edge.touch_probe;
  return probe >= 1 && probe <= kTouchProbeEnable.size() && (probed_ & kTouchProbeEnable.at(probe - 1U)) != 0;
}

bool LatchUnasked::Selected(std::uint16_t selector) const {
  return (selected_ & SelectorBit(selector)) != 0;
}

bool LatchUnasked::AskedFor(const LatchMisuse& misuse) const {
  return misuse.edge != nullptr ? Armed(*misuse.edge) : Selected(misuse.value);
}

/// A frame that never returned was sent before the occasion, or a response by SDO came late.
void LatchUnasked::DropWhatWasAskedFor(FrameNo frame) {
  held_.erase(
      std::remove_if(held_.begin(), held_.end(),
                     [&](const Occasion& held) { return frame < held.first.frame.number && AskedFor(held.first); }),
      held_.end());
}

LatchMisuse LatchUnasked::Misuse(const LatchWord& word, StatusBits bits, std::uint16_t value) const {
  LatchMisuse misuse = report_.Misuse(LatchMisuse::Kind::kStatusBits, word);
  misuse.control = control_.known ? control_.value : std::uint16_t{0};
  misuse.status_bits = bits;
  misuse.value = value;
  return misuse;
}

void LatchUnasked::Hold(const LatchMisuse& misuse) {
  const auto known = std::find_if(held_.begin(), held_.end(), [&](const Occasion& held) {
    return held.first.status_bits == misuse.status_bits && held.first.value == misuse.value;
  });
  if (known == held_.end()) {
    held_.push_back({misuse, misuse, 1, gap_});
    return;
  }
  known->last = misuse;
  ++known->count;
}

void LatchUnasked::OnStatus(const LatchWord& word, bool first, std::uint16_t changed) {
  const auto reserved = static_cast<std::uint16_t>(word.value & latch_->reserved_status & (first ? 0xFFFF : changed));
  if (reserved != 0) report_.Emit(Misuse(word, StatusBits::kReserved, reserved));
  // Before the first control word of the capture the edge may have been armed.
  if (first || !control_.known || control_.doubt || status_.since_forget() < kSettledWords) return;
  for (const device::LatchEdge& edge : latch_->edges) {
    if ((word.value & changed & edge.valid) == 0 || edge.enable == 0 || Armed(edge)) continue;
    LatchMisuse misuse = Misuse(word, StatusBits::kUnarmed, edge.valid);
    misuse.edge = &edge;
    Hold(misuse);
  }
  const std::uint8_t acknowledge = latch_->Acknowledge(word.value);
  if (acknowledge == 0 || (changed & latch_->acknowledge_mask) == 0) return;
  // Another selector is set: the acknowledge may belong to it.
  if (latch_->Selector(control_.value) != 0 || Selected(acknowledge)) return;
  Hold(Misuse(word, StatusBits::kUnselected, acknowledge));
}

void LatchUnasked::Finish() {
  for (const Occasion& held : held_) {
    if (held.gap) {
      report_.NotEvaluable(LatchMisuse::Kind::kStatusBits, held.first.frame, LatchNotEvaluable::Why::kGap);
      continue;
    }
    report_.Emit(held.first);
    for (std::uint64_t n = 1; n < held.count; ++n) report_.Emit(held.last);
  }
  held_.clear();
}

}  // namespace ecaudit::model
