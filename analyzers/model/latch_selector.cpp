#include "analyzers/model/latch_selector.h"

namespace ecaudit::model {
namespace {

using Kind = LatchMisuse::Kind;
using Why = LatchNotEvaluable::Why;

/// Status words that must have come before a missing acknowledge is complained of, at long cycles.
constexpr std::uint32_t kWordsForAcknowledge = 3;
/// Number of status words after which nothing can be evaluated without time stamps.
constexpr std::uint32_t kWordsWithoutTime = 20;

}  // namespace

void LatchSelector::Select(const LatchWord& word, std::uint8_t selector) {
  if (selector == 0) return;
  const device::LatchEdge* asked = latch_->FindSelector(selector);
  const std::size_t n = asked == nullptr ? kMaxLatchEdges : static_cast<std::size_t>(asked - latch_->edges.data());
  asked_ = {};
  if (n >= edges_.size()) {
    LatchMisuse misuse = report_.Misuse(Kind::kInvalidSelector, word);
    misuse.value = selector;
    report_.Emit(misuse);
    return;
  }
  asked_.active = true;
  asked_.selector = selector;
  asked_.edge = static_cast<std::uint8_t>(n);
  asked_.word = word;
  edges_.Selected(n, word.frame);
  if (!control_.known) return;  // set before the capture began, perhaps
  CheckRearmed(word);
  if (status_.known && edges_[n].valid) {
    asked_.expects_ack = true;
    return;
  }
  asked_.status_known = status_.known;
  asked_.status_gap = status_.gap;
  // The status word of the same frame is older than the selector: it may show the valid bit in time.
  if (!word.by_sdo && (status_.cyclic || status_.words == 0)) {
    asked_.undecided = true;
  } else {
    Decide(false, false);
  }
}

/// The value was read already, and the edge was not armed again since.
void LatchSelector::CheckRearmed(const LatchWord& word) {
  const LatchEdgeState& edge = edges_[asked_.edge];
  if (!edge.open || !edge.enabled || !edge.released.seen() || !edge.valid) return;
  if (edge.doubtful) {
    report_.NotEvaluable(Kind::kRearmWithoutEdge, word.frame, Why::kEnableBitUncertain);
    return;
  }
  LatchMisuse misuse = report_.Misuse(Kind::kRearmWithoutEdge, word);
  misuse.edge = &latch_->edges[asked_.edge];
  misuse.value = asked_.selector;
  misuse.capture = edge.capture;
  misuse.related = {edge.capture.armed.number, edge.capture.valid.number, edge.capture.acknowledged.number,
                    edge.released.number};
  report_.Emit(misuse);
}

void LatchSelector::OnCyclicStatus(const LatchWord& word) {
  if (asked_.undecided && word.begun == asked_.word.begun) {
    Decide((word.value & latch_->edges[asked_.edge].valid) != 0, true);
  }
}

void LatchSelector::Decide(bool valid_in_same_frame, bool same_frame_known) {
  asked_.undecided = false;
  if (same_frame_known && valid_in_same_frame) {
    asked_.expects_ack = true;
    return;
  }
  const LatchWord& word = asked_.word;
  if (!same_frame_known && !asked_.status_known) {
    report_.NotEvaluable(Kind::kReadBeforeValid, word.frame, Why::kStatusWordMissing);
    return;
  }
  if (!same_frame_known && asked_.status_gap) {
    report_.NotEvaluable(Kind::kReadBeforeValid, word.frame, Why::kInputsMissing);
    return;
  }
  LatchMisuse misuse = report_.Misuse(Kind::kReadBeforeValid, word);
  misuse.edge = &latch_->edges[asked_.edge];
  misuse.value = asked_.selector;
  const LatchEdgeState& edge = edges_[asked_.edge];
  if (edge.open) misuse.capture = edge.capture;
  misuse.related = {edge.open ? edge.capture.armed.number : 0, status_.known ? status_.frame.number : 0, 0, 0};
  report_.Emit(misuse);
}

void LatchSelector::Deselect(const LatchWord& word) {
  if (!asked_.active) return;
  asked_.dropped = true;
  const LatchEdgeState& edge = edges_[asked_.edge];
  const bool held = latch_->edges[asked_.edge].EnabledBy(word.value);
  if (latch_->Selector(word.value) == 0 && edge.open && held && edge.capture.acknowledged.seen()) {
    edges_.Released(asked_.edge, word.frame);
  }
}

void LatchSelector::CheckAcknowledge(const LatchWord& word) {
  if (word.begun <= asked_.word.done) return;  // older than the selector
  ++asked_.words;
  const LatchEdgeState& edge = edges_[asked_.edge];
  if (latch_->Acknowledge(word.value) == asked_.selector) {
    asked_.acknowledged = true;
    if (edge.open && edge.capture.valid.seen() && !edge.capture.acknowledged.seen() &&
        ((word.value & latch_->edges[asked_.edge].valid) != 0 || edge.loss_pending)) {
      edges_.Acknowledged(asked_.edge, word.frame);
    }
    return;
  }
  if (!asked_.expects_ack || asked_.acknowledged || asked_.evaluated || asked_.dropped) return;
  if (!asked_.word.frame.has_time || !word.frame.has_time) {
    if (asked_.words < kWordsWithoutTime) return;
    asked_.evaluated = true;
    report_.NotEvaluable(Kind::kAckMismatch, word.frame, Why::kNoTimeStamps);
    return;
  }
  const std::int64_t waited = word.frame.time - asked_.word.frame.time;
  if (waited <= ack_limit_ns_ || (!word.by_sdo && asked_.words < kWordsForAcknowledge)) return;
  Complain(word, waited);
}

/// The acknowledge did not come in time.
void LatchSelector::Complain(const LatchWord& word, std::int64_t waited_ns) {
  asked_.evaluated = true;
  const LatchCapture& capture = edges_[asked_.edge].capture;
  LatchMisuse misuse = report_.Misuse(Kind::kAckMismatch, word);
  misuse.edge = &latch_->edges[asked_.edge];
  misuse.control = control_.value;
  misuse.value = asked_.selector;
  misuse.waited_ns = waited_ns;
  misuse.limit_ns = ack_limit_ns_;
  misuse.capture = capture;
  misuse.related = {asked_.word.frame.number, capture.valid.number, 0, 0};
  misuse.inferred = word.inferred || asked_.word.inferred;
  report_.Emit(misuse);
}

}  // namespace ecaudit::model
