/// One capture under observation: the decoder's pipeline, the models of the slaves and the bus that joins them. The
/// only place that feeds the models; other code subscribes at bus() before Run().
#pragma once

#include <cstdint>
#include <memory>

#include "analyzers/options/options.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/capture/frame_source.h"
#include "decoder/pipeline.h"

namespace ecaudit {

namespace model {
class BusModel;
struct SlavePresumed;
}  // namespace model
namespace progress {
class ProgressModel;
}  // namespace progress
namespace sync {
class SyncModel;
}  // namespace sync

/// What an observation needs to know. More costs more time.
enum class Depth : std::uint8_t {
  kFrames,  ///< frames, datagrams and what the decoder makes of them
  kSlaves,  ///< and a model of each slave
  kClocks,  ///< and how the process data arrive against the clocks
};

class Observation {
 public:
  /// @param options  must outlive the observation
  Observation(const AnalysisOptions& options, Depth depth);
  ~Observation();
  Observation(const Observation&) = delete;
  Observation& operator=(const Observation&) = delete;

  [[nodiscard]] EventBus& bus() { return bus_; }
  [[nodiscard]] const Pipeline& pipeline() const { return pipeline_; }
  /// Not at Depth::kFrames.
  [[nodiscard]] const model::BusModel& model() const { return *model_; }
  /// Null unless Depth::kClocks.
  [[nodiscard]] const sync::SyncModel* sync() const { return sync_.get(); }
  /// How far each axis got. Null unless Depth::kClocks.
  [[nodiscard]] const progress::ProgressModel* progress() const { return progress_.get(); }

  /// Reads `source` to its end, its damage or the stop that the options name, then lets the models conclude.
  void Run(capture::FrameSource& source, const PipelineOptions& options);

 private:
  void On(const model::SlavePresumed& slave);

  EventBus bus_;
  Pipeline pipeline_;
  std::unique_ptr<model::BusModel> model_;
  std::unique_ptr<sync::SyncModel> sync_;
  std::unique_ptr<progress::ProgressModel> progress_;
};

}  // namespace ecaudit
