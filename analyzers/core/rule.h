/// A rule: one difference between what happened and what should have happened. One rule, one file in rules/.
///
/// How to add one: derive from Rule, give it a RuleInfo, Subscribe() to the events it needs, override On() for them,
/// report through context(), and register it with a RuleRegistration at file scope. CMake finds the file.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/core/analysis_result.h"
#include "analyzers/core/finding_store.h"
#include "analyzers/core/rule_info.h"
#include "analyzers/model/model_events.h"
#include "decoder/device/object_dictionary.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit {

namespace model {
class BusModel;
struct SlaveModel;
}  // namespace model
namespace startup {
struct Comparison;
}  // namespace startup
namespace sync {
class SyncModel;
}  // namespace sync

/// What an event stream can be subscribed to. One entry an event type.
enum class Topic : std::uint8_t {
  kSlaveFound,
  kAddressAssigned,
  kSlaveCount,
  kAlRequest,
  kAlStatusRead,
  kAlStateForgotten,
  kIdentityLearned,
  kLogicalAccess,
  kAnswered,
  kCaptureHole,
  kFrameLost,
  kFrameDuplicated,
  kFrameUnusable,
  kAccess,
  kMailboxMessage,
  kMailboxRefused,
  kMailboxReadLost,
  kMailboxUnanswered,
  kMailboxErrorReply,
  kSdoTransfer,
  kSdoUnexpected,
  kSdoInfo,
  kEmergency,
  kAlRequestJudged,
  kAlAnswered,
  kAlErrorRepeated,
  kAlChangedByItself,
  kAlErrorCode,
  kAlErrorCleared,
  kAlOverdue,
  kLatchMisuse,
  kLatchNotJudged,
  kSyncSwitchedOn,
  kPllMeasured,
  kOutputGap,
  kSyncSlotMiss,
  kArrivalOff,
  kDriveStateChanged,
  kDriveIllegalCommand,
  kDriveIllegalChange,
  kDriveNoReaction,
  kDriveCommandOutsideOp,
  kDriveMode,
  kDriveFaultExplained,
  kCount
};

/// What a rule may look at and report to. Valid from Rule::Attach() to the end of Rule::Finish().
class RuleContext {
 public:
  RuleContext(FindingStore& to_store, const model::BusModel& of_bus, const AnalysisOptions& with_options)
      : store(to_store), bus(of_bus), options(with_options) {}

  FindingStore& store;
  const model::BusModel& bus;
  const AnalysisOptions& options;
  const Pipeline* pipeline = nullptr;  ///< statistics; complete in Rule::Finish()
  const capture::FrameSource* source = nullptr;
  const sync::SyncModel* sync = nullptr;  ///< clocks and cycles; never null while rules run
  /// Where the start-up differs from what is expected; null before Rule::Finish(), and where nothing is expected.
  const startup::Comparison* startup = nullptr;

  /// Names the finding that explains why the slave cannot do what the request in this frame asks for.
  void ExplainRequest(SlaveId slave, FrameNo request, FindingIndex finding);
  /// What ExplainRequest() named for it last; kNoFinding when nothing did. Rules hear an event in the order of their
  /// ids, so a rule that comes later names the nearer cause.
  [[nodiscard]] FindingIndex ExplanationOf(SlaveId slave, FrameNo request) const;
  /// Names the finding that says what is wrong with the PDO mapping of one direction; kNoFinding: nothing any more.
  void BlameMapping(SlaveId slave, device::PdoDirection direction, FindingIndex finding);
  /// What BlameMapping() named last; kNoFinding when nothing did.
  [[nodiscard]] FindingIndex MappingFault(SlaveId slave, device::PdoDirection direction) const;
  /// "slave 2 (0x1003)", as far as it is known now.
  [[nodiscard]] std::string Label(SlaveId slave) const;
  /// A limit of the catalogue that the user may change, in ns.
  [[nodiscard]] std::int64_t Limit(std::string_view name, std::int64_t otherwise) const;

 private:
  struct Explanation {
    SlaveId slave = kNoSlave;
    FrameNo request = 0;
    FindingIndex finding = kNoFinding;
  };
  std::array<Explanation, 64> explanations_{};  // the newest; older ones are not asked for any more
  std::size_t next_explanation_ = 0;
  std::map<std::pair<SlaveId, device::PdoDirection>, FindingIndex> mapping_faults_;
};

class Rule : public track::EventSink, public model::ModelSink {
 public:
  using model::ModelSink::On;
  using track::EventSink::On;

  explicit Rule(const RuleInfo& info) : info_(info) {}
  Rule(const Rule&) = delete;
  Rule& operator=(const Rule&) = delete;

  [[nodiscard]] const RuleInfo& info() const { return info_; }
  [[nodiscard]] const std::vector<Topic>& topics() const { return topics_; }
  void Attach(RuleContext& context) { context_ = &context; }
  /// The capture has ended: judge what only the whole shows, and link consequences to causes.
  virtual void Finish() {}

 protected:
  void Subscribe(std::initializer_list<Topic> topics) { topics_.insert(topics_.end(), topics); }
  [[nodiscard]] RuleContext& context() const { return *context_; }

  FindingIndex Repeat(SlaveId slave, std::uint64_t key, const FrameRef& frame) {
    return context_->store.Repeat(info_, slave, key, frame);
  }
  FindingIndex Report(std::uint64_t key, Finding finding) {
    return context_->store.Add(info_, key, std::move(finding));
  }
  FindingIndex Report(std::uint64_t key, Severity severity, Finding finding) {
    return context_->store.Add(info_, key, severity, std::move(finding));
  }
  void NotEvaluable(SlaveId slave, std::string reason, FrameNo frame = 0) {
    context_->store.AddNotEvaluable(info_, slave, std::move(reason), frame);
  }

  // For Finish(): where a rule could not be judged in the whole capture.

  /// True, and said, when nothing that the slaves answered is in the capture.
  bool SaidNothingReturned();
  /// True, and said, when no frame on its way to the slaves is in the capture.
  bool SaidNothingSent();
  /// Says `reason` for each slave that `applies` to.
  void NotEvaluableWhere(const std::function<bool(const model::SlaveModel&)>& applies, const std::string& reason);
  /// Says for each slave what `reason_of` returns, unless that is empty.
  void NotEvaluableFor(const std::function<std::string(const model::SlaveModel&)>& reason_of);
  /// For rules about answers to AL requests: says where AL Status was never read after one.
  void SayWhereRequestsAreNotFollowed();

 private:
  const RuleInfo& info_;
  std::vector<Topic> topics_;
  RuleContext* context_ = nullptr;
};

/// One of these at file scope registers a rule: `const RuleRegistration kRegistration{kInfo, MakeRule<AlRefused>};`
struct RuleRegistration {
  using Factory = std::unique_ptr<Rule> (*)();
  RuleRegistration(const RuleInfo& info, Factory factory);
};

template <typename T>
std::unique_ptr<Rule> MakeRule() {
  return std::make_unique<T>();
}

/// A new instance of every registered rule, sorted by id.
[[nodiscard]] std::vector<std::unique_ptr<Rule>> MakeAllRules();

// Short forms for evidence.
[[nodiscard]] Evidence Number(std::string name, std::int64_t value);
[[nodiscard]] Evidence HexNumber(std::string name, std::uint64_t value);
[[nodiscard]] Evidence Text(std::string name, std::string value);
[[nodiscard]] Evidence Real(std::string name, double value);

}  // namespace ecaudit
