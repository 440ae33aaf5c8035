/// Counts what the slave models foretold and whether it came true: the measure of how far a report can be trusted.
#pragma once

#include "analyzers/collect/collector.h"
#include "analyzers/collect/explanations.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/wiring/event_bus.h"

namespace ecaudit {

class PredictionStatistics final : public Collector {
 public:
  /// @param explanations  a request that a finding explains was expected to be refused
  PredictionStatistics(const model::BusModel& model, const Explanations& explanations, EventBus& bus);

  void On(const model::AlAnswered& event);
  void On(const model::AlChangedByItself& event);
  void On(const model::AlOverdue& event);
  void On(const model::Predicted& event);
  /// Compares the working counter where the models leave one value only.
  void On(const track::LogicalAccess& access);

  void Summarise(AnalysisResult& result) override { result.bus.predictions = summary_; }

 private:
  static void Count(PredictionCount& count, bool held, const FrameRef& frame);

  const model::BusModel& model_;
  const Explanations& explanations_;
  PredictionSummary summary_;
};

}  // namespace ecaudit
