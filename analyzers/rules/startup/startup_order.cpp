#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/startup_rule.h"

namespace ecaudit::startup_order {
namespace {

constexpr FindingKind kSlaveMoved{
    .name = "slave-moved",
    .title = "The expected {expected_slave} is at position {position} instead of {expected_position}",
    .message =
        R"(The device with the identity of the expected {expected_slave} is at position {position}. Expected: position
{expected_position}.)",
    .next = "Check the order of the slaves on the bus, or save the expectation again.",
    .identity = "expected_position position"};
constexpr FindingKind kStepMoved{
    .name = "step-moved",
    .title =
        "The {step} comes [after the {actual_after}][before the {actual_before}][{?actual_first}first], not [after the "
        "{expected_after}][{?expected_first}first]",
    .message =
        R"(Expected: the {step} [directly after the {expected_after}][{?expected_first}as the first step]. In the capture
it comes [after the {actual_after}][before the {actual_before}][{?actual_first}first] ({frame}).[{?several} {steps} moved: {moved}[ and
{more}].])",
    .next = "Compare the order of the start-up list in the master's configuration with the expectation.",
    .identity = "step"};
constexpr const FindingKind* kKinds[] = {&kSlaveMoved, &kStepMoved};

constexpr RuleInfo kInfo{.id = "startup-order",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "Steps happen in another order than expected",
                         .needs = "an expectation (startup --expect), and a capture that begins before PREOP",
                         .source = "ETG2100, init commands",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The order of the steps of one slave, and that of the slaves on the bus.

## Why it matters
Order carries meaning: PDO assignment before or after the mapping it refers to, a mode of operation before the
parameters that belong to it, SYNC0 before or after SAFEOP.

## How it is decided
The longest sequence that the expected and the observed start-up have in common counts as in place. Steps that happen
with the expected value outside of it were moved. All moved steps of a slave are one finding, at the first of them.

- A slave that is found by its identity on the other side of its neighbours was moved. A slave whose position differs
  only because another slave came or went was not.
- Not evaluated: the order of steps of different slaves, and that of latching receive times and distributing the system
  time.
- An ENI lists datagrams and mailbox commands apart: each list is evaluated by itself.

## Example
tests/rules/startup-order/violates.trace

## What to do
Compare the order of the start-up list in the master's configuration with the expectation.
)"};

class StartupOrder final : public StartupRule {
 public:
  StartupOrder() : StartupRule(kInfo) {}

 private:
  using Kind = startup::Deviation::Kind;

  [[nodiscard]] bool Reports(Kind kind) const override { return kind == Kind::kOrder || kind == Kind::kSlaveMoved; }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    if (deviation.kind == Kind::kSlaveMoved) {
      const startup::ExpectedSlave& slave = *deviation.expected_slave;
      finding.kind = &kSlaveMoved;
      finding.Set("expected_position", arg::Number(slave.position))
          .Set("position", arg::Number(deviation.position))
          .Set("expected_slave", arg::Text(SlaveText(slave, context().names())));
      return;
    }
    std::vector<std::string> steps;
    for (const startup::ExpectedStep* step : deviation.expected) steps.push_back(Noun(deviation, *step));
    finding.kind = &kStepMoved;
    finding.Set("step", arg::Text(steps.front())).Set("steps", arg::Count(steps.size(), "step"));
    if (deviation.after != nullptr) finding.Set("expected_after", arg::Text(Noun(deviation, *deviation.after)));
    finding.Set("expected_first", arg::Flag(deviation.after == nullptr));
    if (deviation.previous != nullptr) {
      finding.Set("actual_after", arg::Text(Noun(*deviation.previous)));
    } else if (deviation.next != nullptr) {
      finding.Set("actual_before", arg::Text(Noun(*deviation.next)));
    } else {
      finding.Set("actual_first", arg::Flag());
    }
    finding.Set("several", arg::Flag(steps.size() > 1));
    SetSteps(finding, "moved", "more", steps);
    if (deviation.previous != nullptr) AddRelated(finding, deviation.previous->frame.number);
    for (std::size_t i = 1; i < deviation.actual.size(); ++i) AddRelated(finding, deviation.actual[i]->frame.number);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupOrder>};

}  // namespace
}  // namespace ecaudit::startup_order
