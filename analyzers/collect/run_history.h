/// in: beginnings of runs, AL states, requests.  out: what each run of the bus reached.
///
/// keeps: at most kMaxRuns runs; the last of them then reaches to the end of the capture. What lies between a shut-down
/// and the next start, without a request or a state above INIT, begins the next run; at the end of the capture it
/// belongs to the one before.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/collect/collector.h"
#include "analyzers/result/run_summary.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit {

class RunHistory final : public Collector {
 public:
  static constexpr std::size_t kMaxRuns = 100;

  /// @param sync  null: cycles are not measured. Must outlive this, as must `pipeline`
  RunHistory(const sync::SyncModel* sync, const Pipeline& pipeline, EventBus& bus);

  void On(const track::RunBegan& run);
  void On(const track::AlRequest& request);
  void On(const track::AlStatusRead& read);

  void Summarise(AnalysisResult& result) override;

 private:
  void End();
  /// Nothing above INIT was requested or read in the run that goes on.
  [[nodiscard]] bool IsIdle() const { return now_.highest <= 1 && now_.preop_requests == 0; }

  const sync::SyncModel* sync_;
  const Pipeline& pipeline_;
  std::vector<RunSummary> runs_;
  RunSummary now_;
  std::vector<bool> in_op_;
  std::vector<std::uint32_t> preop_requests_;
};

}  // namespace ecaudit
