#include "analyzers/model/latch_reporter.h"

namespace ecaudit::model {

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
    case LatchMisuse::Kind::kReadBeforeValid:
      return "latch-read-before-valid";
    case LatchMisuse::Kind::kInvalidSelector:
      return "latch-invalid-selector";
    case LatchMisuse::Kind::kReservedBits:
      return "latch-reserved-bits";
    case LatchMisuse::Kind::kRearmWithoutEdge:
      return "latch-rearm-without-edge";
    case LatchMisuse::Kind::kValueLost:
      return "latch-value-lost";
    case LatchMisuse::Kind::kAckMismatch:
      return "latch-ack-mismatch";
    case LatchMisuse::Kind::kNotMapped:
      return "latch-not-mapped";
    case LatchMisuse::Kind::kOutsideOp:
      return "latch-outside-op";
    case LatchMisuse::Kind::kTouchProbeConflict:
      return "latch-touch-probe-conflict";
    case LatchMisuse::Kind::kStatusBits:
      return "latch-status-bits";
  }
  return "";
}

void LatchReporter::Step(LatchStep::Kind kind, const device::LatchEdge& edge, const LatchCapture& capture,
                         const FrameRef& frame) {
  LatchStep step;
  step.slave = slave_;
  step.kind = kind;
  step.frame = frame;
  step.edge = &edge;
  step.control = control_.value_or(0);
  step.status = status_;
  step.capture = capture;
  sink_.Publish(step);
}

LatchMisuse LatchReporter::Misuse(LatchMisuse::Kind kind, const LatchWord& word) const {
  LatchMisuse misuse;
  misuse.kind = kind;
  misuse.slave = slave_;
  misuse.frame = word.frame;
  misuse.control = word.value;
  misuse.status = status_;
  misuse.by_sdo = word.by_sdo;
  misuse.inferred = word.inferred;
  return misuse;
}

void LatchReporter::Emit(const LatchMisuse& misuse) {
  if (!evaluates_) return;
  ++misuses_;
  sink_.Publish(misuse);
}

void LatchReporter::NotEvaluable(LatchMisuse::Kind kind, const FrameRef& frame, LatchNotEvaluable::Why why) {
  if (evaluates_) sink_.Publish(LatchNotEvaluable{kind, slave_, frame, why});
}

}  // namespace ecaudit::model
