#include "analyzers/collect/collectors.h"

#include "analyzers/collect/al_history.h"
#include "analyzers/collect/drive_history.h"
#include "analyzers/collect/fault_words.h"
#include "analyzers/collect/frame_layout.h"
#include "analyzers/collect/mailbox_summary.h"
#include "analyzers/collect/prediction_statistics.h"
#include "analyzers/collect/run_history.h"
#include "analyzers/collect/startup_recorder.h"
#include "analyzers/collect/timeline_collector.h"
#include "analyzers/collect/topology.h"

namespace ecaudit {

std::vector<std::unique_ptr<Collector>> MakeCollectors(Observation& observation, const Explanations& explanations,
                                                       Timeline* drawn) {
  EventBus& bus = observation.bus();
  const model::BusModel& model = observation.model();
  std::vector<std::unique_ptr<Collector>> collectors;
  collectors.push_back(std::make_unique<AlHistory>(model, observation.pipeline(), bus));
  collectors.push_back(std::make_unique<MailboxStatistics>(bus));
  collectors.push_back(std::make_unique<DriveHistory>(model, bus));
  collectors.push_back(std::make_unique<startup::StartupRecorder>(model, observation.pipeline(), bus));
  collectors.push_back(std::make_unique<PredictionStatistics>(model, explanations, bus));
  collectors.push_back(std::make_unique<RunHistory>(observation.sync(), observation.pipeline(), bus));
  collectors.push_back(std::make_unique<Topology>(model, bus));
  collectors.push_back(std::make_unique<FrameLayout>(bus));
  collectors.push_back(std::make_unique<FaultWords>(bus));
  if (drawn != nullptr) {
    collectors.push_back(std::make_unique<timeline::TimelineCollector>(model, *observation.sync(), bus, *drawn));
  }
  return collectors;
}

}  // namespace ecaudit
