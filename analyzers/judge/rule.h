/// A rule: one difference between what happened and what should have happened. One rule, one file in rules/.
///
/// How to add one: derive from Rule, give it a RuleInfo, Subscribe() the events it needs, report through Report(), and
/// register it with a RuleRegistration at file scope. CMake finds the file.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "analyzers/result/finding.h"
#include "analyzers/result/rule_info.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/base/ids.h"

namespace ecaudit {

class RuleContext;
namespace model {
struct SlaveModel;
}  // namespace model

class Rule {
 public:
  explicit Rule(const RuleInfo& info) : info_(info) {}
  Rule(const Rule&) = delete;
  Rule& operator=(const Rule&) = delete;
  virtual ~Rule() = default;

  [[nodiscard]] const RuleInfo& info() const { return info_; }
  /// From here on it receives the events that it subscribed to.
  void Attach(RuleContext& context, EventBus& bus);
  /// The capture has ended: evaluate what only the whole shows, and link consequences to causes.
  virtual void Finish() {}

 protected:
  /// In the constructor: `Subscribe<model::AlAnswered>(&AlRefused::On);`, the event named where the handler is
  /// overloaded. Rules receive what happened before the models learn from it, unless another stage is given.
  template <class Event, class T>
  void Subscribe(void (T::*handler)(const Event&), Stage stage = Stage::kBeforeModel) {
    subscriptions_.push_back(EventBus::Subscription::Of(stage, static_cast<T&>(*this), handler));
  }
  /// Of events about some bytes of a slave, those that touch `range`.
  template <OfMemory Event, class T>
  void Subscribe(void (T::*handler)(const Event&), MemoryRange range, Stage stage = Stage::kBeforeModel) {
    subscriptions_.push_back(EventBus::Subscription::Of(stage, static_cast<T&>(*this), handler, range));
  }
  [[nodiscard]] RuleContext& context() const { return *context_; }

  FindingIndex Repeat(SlaveId slave, std::uint64_t key, const FrameRef& frame);
  FindingIndex Report(std::uint64_t key, Finding finding);
  FindingIndex Report(std::uint64_t key, Severity severity, Finding finding);
  void NotEvaluable(SlaveId slave, Reason reason, FrameNo frame = 0);
  void NotEvaluable(SlaveId slave, ReasonCode code, FrameNo frame = 0) { NotEvaluable(slave, Reason::Of(code), frame); }
  void NotEvaluable(SlaveId slave, ReasonCode code, const Word& what, FrameNo frame = 0) {
    NotEvaluable(slave, Reason::Of(code, what), frame);
  }

  // For Finish(): where a rule could not be evaluated in the whole capture.

  /// True, and reported, if no answer of the slaves is in the capture.
  bool NotEvaluableWithoutReturns();
  /// True, and reported, if no frame on its way to the slaves is in the capture.
  bool NotEvaluableWithoutSent();
  /// Reports `reason` for each slave that `applies(const model::SlaveModel&)` to.
  template <class Applies>
  void NotEvaluableWhere(Applies applies, const Reason& reason) {
    ForEachSlave([&](SlaveId id, const model::SlaveModel& slave) {
      if (applies(slave)) NotEvaluable(id, reason);
    });
  }
  /// Adds for each slave what `reason_of(const model::SlaveModel&)` returns: std::optional<Reason>.
  template <class ReasonOf>
  void NotEvaluableFor(ReasonOf reason_of) {
    ForEachSlave([&](SlaveId id, const model::SlaveModel& slave) {
      auto reason = reason_of(slave);
      if constexpr (std::is_same_v<decltype(reason), std::string>) {
        if (!reason.empty()) NotEvaluable(id, std::move(reason));
      } else {
        if (reason) NotEvaluable(id, std::move(*reason));
      }
    });
  }
  /// For rules about answers to AL requests: reports where AL Status was never read after one.
  void NotEvaluableWhereRequestsAreNotFollowed();

 private:
  template <class Visit>
  void ForEachSlave(Visit visit) {
    for (SlaveId id = 0; const model::SlaveModel* slave = SlaveOrNull(id); ++id) visit(id, *slave);
  }
  [[nodiscard]] const model::SlaveModel* SlaveOrNull(SlaveId id) const;

  const RuleInfo& info_;
  std::vector<EventBus::Subscription> subscriptions_;
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

/// A new instance of every registered rule, each after those that RuleInfo::after names.
/// @param shuffle  which of the many such orders; 0: by id as far as possible. No report may depend on it.
[[nodiscard]] std::vector<std::unique_ptr<Rule>> MakeAllRules(std::uint32_t shuffle = 0);

}  // namespace ecaudit
