/// What a rule may look at and report to.
///
/// Views are narrow: a rule includes the header of what it asks for, and nothing else of the analysis.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/judge/finding_store.h"
#include "analyzers/options/slave_names.h"
#include "analyzers/result/finding.h"
#include "decoder/base/ids.h"
#include "decoder/device/object_dictionary.h"

namespace ecaudit {

class Explanations;
class Observation;
struct AnalysisOptions;
struct AnalysisResult;
struct PipelineStatistics;
namespace bus {
struct PairingStatistics;
}  // namespace bus
namespace capture {
class FrameSource;
}  // namespace capture
namespace model {
class BusModel;
struct SlaveModel;
}  // namespace model
namespace progress {
class ProgressModel;
}  // namespace progress
namespace startup {
struct Comparison;
}  // namespace startup
namespace sync {
class SyncModel;
}  // namespace sync
namespace track {
class Network;
}  // namespace track

/// Valid from Rule::Attach() to the end of Rule::Finish().
class RuleContext {
 public:
  /// @param observation  of Depth::kClocks
  RuleContext(FindingStore& to_store, const Observation& observation, const capture::FrameSource& source,
              const AnalysisOptions& options, Explanations& explanations);

  FindingStore& store;

  [[nodiscard]] const model::BusModel& bus() const { return bus_; }
  [[nodiscard]] const model::SlaveModel& slave(SlaveId id) const;
  [[nodiscard]] std::size_t slave_count() const;
  [[nodiscard]] const track::Network& network() const;
  /// Clocks and cycles.
  [[nodiscard]] const sync::SyncModel& sync() const { return sync_; }
  /// How far each axis got; complete in Rule::Finish().
  [[nodiscard]] const progress::ProgressModel& progress() const { return progress_; }
  [[nodiscard]] const AnalysisOptions& options() const { return options_; }
  /// What sentences call a slave.
  [[nodiscard]] const SlaveNames& names() const { return options_.slave_names; }
  /// Up to the packet at hand; complete in Rule::Finish().
  [[nodiscard]] const PipelineStatistics& statistics() const;
  [[nodiscard]] const bus::PairingStatistics& pairing() const;
  [[nodiscard]] const capture::FrameSource& source() const { return source_; }
  /// Where the start-up differs from what is expected; null before Rule::Finish(), and where nothing is expected.
  [[nodiscard]] const startup::Comparison* startup() const { return startup_; }
  void SetStartup(const startup::Comparison& comparison) { startup_ = &comparison; }
  /// What was collected of the capture, findings apart; null before Rule::Finish().
  [[nodiscard]] const AnalysisResult* summary() const { return summary_; }
  void SetSummary(const AnalysisResult& summary) { summary_ = &summary; }

  /// Names the finding that explains why the slave cannot do what the request in this frame asks for.
  void ExplainRequest(SlaveId slave, FrameNo request, FindingIndex finding);
  /// What ExplainRequest() named for it last; kNoFinding when nothing did. Of rules that may explain one request, the
  /// one with the nearer cause declares the others in RuleInfo::after.
  [[nodiscard]] FindingIndex ExplanationOf(SlaveId slave, FrameNo request) const;
  /// All findings that explain it, the newest first.
  [[nodiscard]] std::vector<FindingIndex> ExplanationsOf(SlaveId slave, FrameNo request) const;
  /// Names the finding about what is wrong with the PDO mapping of one direction; kNoFinding: nothing any more.
  void BlameMapping(SlaveId slave, device::PdoDirection direction, FindingIndex finding);
  /// What BlameMapping() named last; kNoFinding when nothing did.
  [[nodiscard]] FindingIndex MappingFault(SlaveId slave, device::PdoDirection direction) const;
  /// "slave 2 (0x1003)", as far as it is known now.
  [[nodiscard]] std::string Label(SlaveId slave) const;
  /// A limit of the catalogue that the user may change, in ns.
  [[nodiscard]] std::int64_t Limit(std::string_view name, std::int64_t otherwise) const;

 private:
  const Observation& observation_;
  const model::BusModel& bus_;
  const sync::SyncModel& sync_;
  const progress::ProgressModel& progress_;
  const capture::FrameSource& source_;
  const AnalysisOptions& options_;
  Explanations& explanations_;
  const startup::Comparison* startup_ = nullptr;
  const AnalysisResult* summary_ = nullptr;
};

}  // namespace ecaudit
