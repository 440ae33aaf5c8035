#include <algorithm>

#include "analyzers/judge/startup_rule.h"
#include "decoder/base/text.h"

namespace ecaudit::startup_step_unexpected {
namespace {

constexpr RuleInfo kInfo{.id = "startup-step-unexpected",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .title = "A step happens that a strict expectation does not list",
                         .needs = "an expectation with \"strict\": true",
                         .source = "ETG2100, init commands",
                         .doc = R"(
## What it checks
Steps and slaves that the capture shows and the expectation does not list.

## Why it matters
A parameter that somebody added can override another one; a master with another configuration often shows by what it
sends in addition.

## How it is decided
Only where the expectation says "strict": true. Repetitions of a step right behind it are one step. Steps that have a
counterpart at another place or with another value are left to startup-order and startup-value.

## Example
tests/rules/startup-step-unexpected/violates.trace

## What to do
Find out where the step comes from. If it is wanted, add it to the expectation or save that anew; if what else the
master sends does not matter, take "strict" out.
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
      finding.title = "A slave that is not expected is on the bus";
      finding.message = "The expectation lists no slave with its identity at its place.";
      return;
    }
    std::vector<std::string> steps;
    for (const StartupStep* step : deviation.actual) {
      steps.push_back(Noun(*step) + (step->text.empty() ? "" : " = " + step->text));
      if (finding.related_frames.size() < FindingStore::kMaxRelatedFrames) AddRelated(finding, step->frame.number);
    }
    const std::string first = Noun(*deviation.actual.front());
    finding.title = (steps.size() == 1 ? first : Count(steps.size(), "step")) + " not expected in " +
                    std::string(Title(deviation.phase));
    if (steps.size() > 1) finding.title += ", first the " + first;
    const auto listed = [&](const StartupStep* step) {
      const startup::ExpectedSlave* slave = deviation.expected_slave;
      return slave != nullptr &&
             std::any_of(slave->steps.begin(), slave->steps.end(),
                         [&](const startup::ExpectedStep& expected) { return expected.key == step->key; });
    };
    if (std::all_of(deviation.actual.begin(), deviation.actual.end(), listed)) {
      finding.message = "Done once more than the strict expectation lists: " + ListText(steps) + ".";
    } else {
      finding.message = "The strict expectation does not list: " + ListText(steps) + ".";
    }
    finding.evidence.push_back(Text("phase", std::string(Name(deviation.phase))));
    finding.evidence.push_back(Text("expected", "nothing"));
    finding.evidence.push_back(Text("actual", ListText(steps)));
    finding.evidence.push_back(Number("steps", static_cast<std::int64_t>(steps.size())));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupStepUnexpected>};

}  // namespace
}  // namespace ecaudit::startup_step_unexpected
