#include <algorithm>

#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/startup_rule.h"

namespace ecaudit::startup_step_unexpected {
namespace {

constexpr FindingKind kSlaveUnexpected{.name = "slave-unexpected",
                                       .title = "A slave that the expectation does not list is on the bus",
                                       .message = "The expectation lists no slave with its identity at its position.",
                                       .next = "Remove the slave, or save the expectation again."};
constexpr FindingKind kUnexpected{
    .name = "unexpected",
    .title = "[{?one}{step}][{!one}{steps}] not expected in {phase}[{!one}, first the {step}]",
    .message =
        R"([{?listed}The master does this once more than the strict expectation lists:][{!listed}The strict expectation
does not list:] {actual}[ and {more}].)",
    .next = R"(Find out where the step comes from. If it is wanted, add it to the expectation or save the expectation
again.)",
    .identity = "phase step"};
constexpr const FindingKind* kKinds[] = {&kSlaveUnexpected, &kUnexpected};

constexpr Word kNothing{"nothing", "nothing"};

constexpr RuleInfo kInfo{.id = "startup-step-unexpected",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "A step happens that a strict expectation does not list",
                         .needs = "an expectation with \"strict\": true",
                         .source = "ETG2100, init commands",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Steps and slaves that the capture shows and the expectation does not list.

## Why it matters
An added parameter can override another one. A master with another configuration often shows by what it sends in
addition.

## How it is decided
Only if the expectation has "strict": true. Repetitions directly after a step are one step. Steps that have a
counterpart at another place or with another value belong to startup-order and startup-value.

## Example
tests/rules/startup-step-unexpected/violates.trace

## What to do
Find out where the step comes from. If it is wanted, add it to the expectation or save the expectation again. If other
steps of the master do not matter, remove "strict".
)"};

class StartupStepUnexpected final : public StartupRule {
 public:
  StartupStepUnexpected() : StartupRule(kInfo) {}

 private:
  using Kind = startup::Deviation::Kind;

  [[nodiscard]] bool Reports(Kind kind) const override {
    return kind == Kind::kUnexpected || kind == Kind::kSlaveUnexpected;
  }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    if (deviation.kind == Kind::kSlaveUnexpected) {
      finding.kind = &kSlaveUnexpected;
      return;
    }
    std::vector<std::string> steps;
    for (const StartupStep* step : deviation.actual) {
      steps.push_back(Noun(*step) + (step->text.empty() ? "" : " = " + step->text));
      if (finding.related_frames.size() < FindingStore::kMaxRelatedFrames) AddRelated(finding, step->frame.number);
    }
    const auto listed = [&](const StartupStep* step) {
      const startup::ExpectedSlave* slave = deviation.expected_slave;
      return slave != nullptr && std::ranges::any_of(slave->steps, [&](const startup::ExpectedStep& expected) {
               return expected.key == step->key;
             });
    };
    finding.kind = &kUnexpected;
    finding.Set("phase", PhaseValue(deviation.phase)).Set("expected", arg::Of(kNothing));
    SetSteps(finding, "actual", "more", steps);
    finding.Set("steps", arg::Count(steps.size(), "step"))
        .Set("step", arg::Text(Noun(*deviation.actual.front())))
        .Set("one", arg::Flag(steps.size() == 1))
        .Set("listed", arg::Flag(std::ranges::all_of(deviation.actual, listed)));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupStepUnexpected>};

}  // namespace
}  // namespace ecaudit::startup_step_unexpected
