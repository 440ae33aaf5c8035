/// Counts what the slave models foretold and whether it came true: the measure of how far a report can be trusted.
#pragma once

#include "analyzers/core/analysis_result.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"

namespace ecaudit {

class PredictionStatistics {
 public:
  /// @param explained a finding says why the slave could not follow this request, so the refusal was to be expected
  void On(const model::AlAnswered& event, bool explained);
  void On(const model::AlChangedByItself& event);
  void On(const model::AlOverdue& event);
  void On(const model::Predicted& event);
  /// Compares the working counter where the models leave one value only.
  void On(const track::LogicalAccess& access, const model::BusModel& bus);

  [[nodiscard]] const PredictionSummary& summary() const { return summary_; }

 private:
  static void Count(PredictionCount& count, bool held, const FrameRef& frame);

  PredictionSummary summary_;
};

}  // namespace ecaudit
