/// in: what happened to the latches, and what was wrong.  out: LatchStep, LatchMisuse, LatchNotEvaluable.
///
/// keeps: the last words, which every event cites.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "analyzers/model/latch_words.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/event_sink.h"

namespace ecaudit::model {

class LatchReporter {
 public:
  /// @param evaluates  false: steps are reported, misuse is not  @param sink must outlive this
  LatchReporter(SlaveId slave, bool evaluates, EventSink& sink) : slave_(slave), evaluates_(evaluates), sink_(sink) {}

  void SawControl(std::uint16_t word) { control_ = word; }
  void SawStatus(std::uint16_t word) { status_ = word; }
  [[nodiscard]] std::optional<std::uint16_t> control() const { return control_; }
  [[nodiscard]] std::optional<std::uint16_t> status() const { return status_; }
  [[nodiscard]] std::uint64_t misuses() const { return misuses_; }

  void Step(LatchStep::Kind kind, const device::LatchEdge& edge, const LatchCapture& capture, const FrameRef& frame);
  /// To be filled and handed to Emit().
  [[nodiscard]] LatchMisuse Misuse(LatchMisuse::Kind kind, const LatchWord& word) const;
  void Emit(const LatchMisuse& misuse);
  void NotEvaluable(LatchMisuse::Kind kind, const FrameRef& frame, LatchNotEvaluable::Why why);

 private:
  SlaveId slave_;
  bool evaluates_;
  EventSink& sink_;
  std::optional<std::uint16_t> control_, status_;
  std::uint64_t misuses_ = 0;
};

}  // namespace ecaudit::model
