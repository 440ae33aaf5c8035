/// in: AL requests and status reads.  out: the AL history of each slave for the report.
#pragma once

#include <deque>
#include <vector>

#include "analyzers/collect/collector.h"
#include "analyzers/collect/step_room.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/events.h"

namespace ecaudit {

class AlHistory final : public Collector {
 public:
  static constexpr std::size_t kMaxSteps = 200;        ///< a slave; later ones are counted only
  static constexpr std::size_t kOwnSteps = 12;         ///< that a slave has, whatever the others take
  static constexpr std::size_t kMaxAllSteps = 10'000;  ///< of all slaves, beyond these
  static constexpr std::uint64_t kAtOnce = 4'000;      ///< of all slaves, however short the capture is, and ...
  static constexpr std::uint64_t kBytesAStep = 100;    ///< ... one more for this many bytes of frames

  /// @param model distinguishes echoes from errors; must outlive this, as @param pipeline must
  AlHistory(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus);

  void On(const track::AlRequest& request);
  void On(const track::AlStatusRead& read);
  void On(const track::AlStatusCodeRead& read);
  void Summarise(AnalysisResult& result) override;

 private:
  struct Story {
    std::vector<AlStep> steps;
    std::uint64_t left_out = 0;
    std::optional<std::uint16_t> status, code;  ///< last observed
    bool echo = false;                          ///< the error bit of `status` is one
    bool asked_away = false;                    ///< another state was requested since `status` was observed last
  };
  Story& Get(SlaveId slave);
  void Add(Story& story, const AlStep& step, std::size_t place);

  const model::BusModel& model_;
  std::deque<Story> stories_;
  StepRoom room_;
  std::uint64_t all_steps_ = 0;
  std::size_t shared_steps_ = 0;  // beyond those that each slave has
};

}  // namespace ecaudit
