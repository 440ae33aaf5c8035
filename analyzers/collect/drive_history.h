/// in: events of the drive units.  out: the story of each drive for the report.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/collect/collector.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/wiring/event_bus.h"

namespace ecaudit {

class DriveHistory final : public Collector {
 public:
  static constexpr std::size_t kMaxSteps = 200;        ///< a slave; later ones are counted only
  static constexpr std::size_t kMaxAllSteps = 20'000;  ///< of all slaves
  static constexpr std::size_t kMaxEnabled = 20;       ///< a slave

  /// @param model must outlive this
  DriveHistory(const model::BusModel& model, EventBus& bus);

  void On(const model::DriveCommanded& event);
  void On(const model::DriveStateChanged& event);
  void On(const model::DriveMode& event);
  void On(const model::DriveWarning& event);
  void On(const model::DriveFaultExplained& event);

  void Summarise(AnalysisResult& result) override;

 private:
  struct Story {
    std::vector<DriveStep> steps;
    std::uint64_t left_out = 0;
    std::uint64_t faults = 0;
    std::vector<std::string> enabled;
    FrameRef switched_on;
  };
  /// The axes of which control or status word was seen; none for a slave that is no drive.
  [[nodiscard]] std::vector<DriveSummary> SummariseSlave(SlaveId slave) const;
  [[nodiscard]] DriveSummary SummariseAxis(SlaveId slave, const model::DriveUnit& unit) const;
  Story& Get(SlaveId slave, std::uint8_t axis);
  void Add(Story& story, DriveStep step);

  const model::BusModel& model_;
  std::map<std::pair<SlaveId, std::uint8_t>, Story> stories_;  ///< by slave and axis
  std::size_t all_steps_ = 0;
};

}  // namespace ecaudit
