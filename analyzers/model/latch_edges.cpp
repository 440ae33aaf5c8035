#include "analyzers/model/latch_edges.h"

#include <algorithm>

#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

using Kind = LatchMisuse::Kind;
using Why = LatchNotEvaluable::Why;

/// How long a value may lie unread at the end of the capture before it counts as not read, in ns.
constexpr std::int64_t kUnreadAtEnd = 1'000'000'000;
/// A capture that ends earlier must show that the master left out this many cycles, and uploads of the duration that
/// the slave needs, before its reading counts as missing.
constexpr std::uint64_t kMissedChances = 100;

}  // namespace

void LatchEdges::SetFamily(const device::LatchDescription* latch) {
  latch_ = latch;
  captures_.clear();
  captures_left_out_ = 0;
  edges_.clear();
}

void LatchEdges::Need() {
  if (edges_.empty()) edges_.resize(std::min(latch_->edges.size(), kMaxLatchEdges));
}

void LatchEdges::Forget() {
  stray_read_ = false;
  unread_ = 0;
  for (LatchEdgeState& edge : edges_) {
    edge.enabled = edge.valid = edge.open = edge.stale = edge.doubtful = edge.loss_pending = false;
    edge.kept = LatchEdgeState::kNotKept;
  }
}

void LatchEdges::ForgetAtGap(const FrameRef& frame) {
  if (any_unread()) report_.NotEvaluable(Kind::kValueLost, frame, Why::kGap);
  Forget();
}

// --- enable bits --------------------------------------------------------------------------------------------------

void LatchEdges::OnEnable(std::size_t n, bool enabled, const LatchWord& word, bool first) {
  LatchEdgeState& edge = edges_[n];
  if (enabled && edge.enabled && control_.doubt && (control_.doubt_zero & latch_->edges[n].enable) != 0) {
    edge.doubtful = true;
  }
  if (enabled == edge.enabled) return;
  if (enabled && first) {
    // Enabled before the capture began, or before its first word that the drive took.
    FoundEnabled(n);
    Keep(edge);
  } else if (enabled) {
    Arm(n, word);
  } else {
    Disarm(n, word);
  }
}

void LatchEdges::FoundEnabled(std::size_t n) {
  edges_[n].enabled = true;
  if (!edges_[n].open) Open(n);
}

void LatchEdges::Open(std::size_t n) {
  LatchEdgeState& edge = edges_[n];
  edge.capture = {};
  edge.capture.edge = static_cast<std::uint8_t>(n);
  edge.open = true;
  edge.stale = edge.doubtful = edge.loss_pending = false;
  edge.released = {};
  edge.armed_done = 0;
  ClearUnread(n);
  if (captures_.size() < kMaxCaptures && TakeFrom(allowance_, 1)) {
    edge.kept = captures_.size();
    captures_.push_back(edge.capture);
  } else {
    edge.kept = LatchEdgeState::kNotKept;
    ++captures_left_out_;
  }
}

void LatchEdges::Keep(const LatchEdgeState& edge) {
  if (edge.kept != LatchEdgeState::kNotKept) captures_[edge.kept] = edge.capture;
}

void LatchEdges::Arm(std::size_t n, const LatchWord& word) {
  LatchEdgeState& edge = edges_[n];
  if (edge.open && edge.loss_pending) Lose(n);
  const bool again = edge.history.armed > 0;
  if (edge.kept != LatchEdgeState::kNotKept) captures_[edge.kept].rearmed = word.frame;
  Open(n);
  edge.enabled = true;
  edge.stale = edge.valid;
  edge.armed_done = word.done;
  edge.capture.armed = word.frame;
  edge.capture.assumed = word.inferred;
  if (++edge.history.armed == 1) {
    edge.history.first_armed = edge.capture;
    edge.history.words_when_armed = control_.words;
  }
  Keep(edge);
  Step(again ? LatchStep::Kind::kRearmed : LatchStep::Kind::kArmed, n, word.frame);
}

void LatchEdges::Disarm(std::size_t n, const LatchWord& word) {
  LatchEdgeState& edge = edges_[n];
  edge.enabled = false;
  if (!edge.open) return;
  edge.capture.disarmed = word.frame;
  edge.disarmed_done = word.done;
  Keep(edge);
  Step(LatchStep::Kind::kDisarmed, n, word.frame);
  const LatchCapture& capture = edge.capture;
  // A value that the master had not received when it sent this word is none that it forgot.
  if (capture.valid.seen() && !capture.read.seen() && !capture.valid_before && capture.valid.number < word.begun) {
    edge.loss_pending = true;
    return;
  }
  if (capture.valid.seen() && !capture.read.seen() && capture.valid_before) {
    report_.NotEvaluable(Kind::kValueLost, word.frame, Why::kValidFromStart);
  }
  if (edge.stale) {
    report_.NotEvaluable(Kind::kValueLost, word.frame, Why::kValidStayed);
  }
  edge.open = false;
  ClearUnread(n);
}

void LatchEdges::ReadBy(std::size_t n, LatchReading reading, const FrameRef& frame,
                        std::optional<std::int64_t> position) {
  LatchEdgeState& edge = edges_[n];
  if (!edge.open || edge.capture.read.seen()) return;
  edge.capture.read = frame;
  edge.capture.reading = reading;
  if (position) edge.capture.position = position;
  edge.loss_pending = false;
  ++edge.history.read;
  ClearUnread(n);
  Keep(edge);
  Step(LatchStep::Kind::kRead, n, frame);
  if (!edge.enabled) edge.open = false;
}

void LatchEdges::Lose(std::size_t n) {
  LatchEdgeState& edge = edges_[n];
  edge.loss_pending = edge.open = false;
  ++edge.history.lost;
  ClearUnread(n);
  if (!edge.history.first_unread.valid.seen()) edge.history.first_unread = edge.capture;
  const FrameRef& frame = edge.capture.disarmed;
  if (unknown_inputs_) {
    report_.NotEvaluable(Kind::kValueLost, frame, Why::kInputsUnknown);
    return;
  }
  if (stray_read_) {
    report_.NotEvaluable(Kind::kValueLost, frame, Why::kEdgeUndocumented);
    return;
  }
  LatchMisuse misuse =
      report_.Misuse(Kind::kValueLost, {control_.value, frame, 0, 0, !control_.cyclic, edge.capture.assumed});
  misuse.edge = &latch_->edges[n];
  misuse.capture = edge.capture;
  misuse.related = {edge.capture.armed.number, edge.capture.valid.number, edge.capture.selected.number, 0};
  report_.Emit(misuse);
}

void LatchEdges::LearnMapping(std::size_t n) {
  LatchEdgeState& edge = edges_[n];
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
                                 [this](const Signal& signal) { return LatchPlaces::IsStray(*latch_, signal.index); });
  edge.history.mapping = mapped ? Mapping::kMapped : stray ? Mapping::kUndocumented : Mapping::kNotMapped;
}

// --- valid bits ---------------------------------------------------------------------------------------------------

void LatchEdges::OnValid(const LatchWord& word, bool first) {
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    LatchEdgeState& edge = edges_[n];
    if ((word.value & latch_->edges[n].valid) == 0 || edge.valid) continue;
    edge.valid = true;
    const bool arming_seen = edge.open && edge.capture.armed.seen();
    if (!edge.open && !first) continue;  // after the enable bit was cleared: the master no longer waits for it
    if (!edge.open) Open(n);
    if (arming_seen && word.begun <= edge.armed_done) {
      edge.stale = true;
      continue;
    }
    edge.capture.valid = word.frame;
    edge.capture.valid_before = first && !arming_seen;
    ++edge.history.valid;
    SetUnread(n);
    LearnMapping(n);
    Keep(edge);
    if (!edge.capture.valid_before) Step(LatchStep::Kind::kValid, n, word.frame);
  }
}

void LatchEdges::OnInvalid(const LatchWord& word) {
  for (std::size_t n = 0; n < edges_.size(); ++n) {
    LatchEdgeState& edge = edges_[n];
    if ((word.value & latch_->edges[n].valid) != 0 || !edge.valid) continue;
    edge.valid = edge.stale = false;
    if (!edge.open || !edge.capture.valid.seen()) continue;
    // Also where the inputs of the frame that disarms it show it: the master knew of the value, and gave it up.
    if (edge.loss_pending) Lose(n);
    edge.loss_pending = edge.open = false;
    ClearUnread(n);
    if (edge.enabled) Open(n);  // the drive itself waits for the next edge
  }
}

// --- the selector -------------------------------------------------------------------------------------------------

void LatchEdges::Selected(std::size_t n, const FrameRef& frame) {
  LatchEdgeState& edge = edges_[n];
  if (!edge.open || edge.capture.selected.seen()) return;
  edge.capture.selected = frame;
  Keep(edge);
}

void LatchEdges::Acknowledged(std::size_t n, const FrameRef& frame) {
  LatchEdgeState& edge = edges_[n];
  edge.capture.acknowledged = frame;
  Keep(edge);
  ReadBy(n, LatchReading::kSelector, frame, std::nullopt);
}

// --- the end ------------------------------------------------------------------------------------------------------

void LatchEdges::Finish(std::size_t n, const LatchStatus& status) {
  LatchEdgeState& edge = edges_[n];
  CheckUnreachable(n, status);
  // Words by SDO: the status was not read again, so the master does not know either whether the value is still
  // there. In process data the last status word shows that it is.
  if (edge.open && edge.loss_pending && !status.cyclic && status.begun <= edge.disarmed_done) Lose(n);
  const LatchCapture& capture = edge.capture;
  const bool lies_unread = edge.open && capture.valid.seen() && !capture.read.seen() && !capture.valid_before;
  const bool long_enough =
      capture.valid.has_time && status.frame.has_time && Elapsed(capture.valid.time, status.frame.time) > kUnreadAtEnd;
  if (lies_unread && long_enough && !edge.history.first_unread.valid.seen()) edge.history.first_unread = capture;
  const LatchCapture& unread = edge.history.first_unread;
  if (edge.history.read > 0) return;
  if (!unread.valid.seen()) {
    if (lies_unread && edge.history.mapping == LatchEdgeHistory::Mapping::kNotMapped) {
      report_.NotEvaluable(Kind::kNotMapped, capture.valid, Why::kEndsWhileUnread);
    }
    return;
  }
  const FrameRef& frame = unread.armed.seen() ? unread.armed : unread.valid;
  switch (edge.history.mapping) {
    case LatchEdgeHistory::Mapping::kMapped:
      break;
    case LatchEdgeHistory::Mapping::kUnknown:
      report_.NotEvaluable(Kind::kNotMapped, frame, Why::kInputsUnknown);
      break;
    case LatchEdgeHistory::Mapping::kUndocumented:
      report_.NotEvaluable(Kind::kNotMapped, frame, Why::kPositionUndocumented);
      break;
    case LatchEdgeHistory::Mapping::kNotMapped: {
      LatchMisuse misuse =
          report_.Misuse(Kind::kNotMapped, {control_.value, frame, 0, 0, !control_.cyclic, unread.assumed});
      misuse.edge = &latch_->edges[n];
      misuse.capture = unread;
      misuse.related = {unread.valid.number, unread.disarmed.number, 0, 0};
      report_.Emit(misuse);
      break;
    }
  }
}

/// It was armed for long, and no status word came that could show a capture.
void LatchEdges::CheckUnreachable(std::size_t n, const LatchStatus& status) {
  LatchEdgeState& edge = edges_[n];
  const FrameRef& armed = edge.history.first_armed.armed;
  if (!armed.seen() || edge.history.valid > 0 || status.known || status.words > 0 || asked_) return;
  const bool long_enough =
      armed.has_time && control_.frame.has_time && Elapsed(armed.time, control_.frame.time) > kUnreadAtEnd;
  const ProcessLayout& inputs = process_.tx();
  LearnMapping(n);
  if (!inputs.known()) {
    report_.NotEvaluable(Kind::kNotMapped, armed, Why::kInputsUnknown);
    return;
  }
  // Of an edge whose object the manual does not name: none of those that could be it.
  const bool none = std::none_of(inputs.signals.begin(), inputs.signals.end(),
                                 [this](const Signal& signal) { return LatchPlaces::IsStray(*latch_, signal.index); });
  const bool mapped = edge.history.mapping == LatchEdgeHistory::Mapping::kMapped;
  if (mapped || !none || inputs.Find(latch_->status_object, 0) != nullptr) return;
  const std::int64_t watched = armed.has_time && control_.frame.has_time ? Elapsed(armed.time, control_.frame.time) : 0;
  const std::uint64_t cycles = control_.words - std::min(control_.words, edge.history.words_when_armed);
  // The inputs cannot show it, but the master may upload it yet.
  const bool early = control_.cyclic && cycles >= kMissedChances && slowest_sdo_ns_ > 0 &&
                     watched / slowest_sdo_ns_ >= static_cast<std::int64_t>(kMissedChances);
  if (!long_enough && !early) {
    report_.NotEvaluable(Kind::kNotMapped, armed, Why::kEndsWhileUnread);
  } else {
    LatchMisuse misuse = report_.Misuse(
        Kind::kNotMapped, {control_.value, armed, 0, 0, !control_.cyclic, edge.history.first_armed.assumed});
    misuse.edge = &latch_->edges[n];
    misuse.capture = edge.history.first_armed;
    if (!long_enough) {
      misuse.inferred = true;
      misuse.waited_ns = watched;
      misuse.cycles = cycles;
      misuse.limit_ns = slowest_sdo_ns_;
    }
    report_.Emit(misuse);
  }
}

void LatchEdges::Step(LatchStep::Kind kind, std::size_t n, const FrameRef& frame) {
  report_.Step(kind, latch_->edges[n], edges_[n].capture, frame);
}

}  // namespace ecaudit::model
