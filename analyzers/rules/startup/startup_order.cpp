#include "analyzers/judge/startup_rule.h"
#include "decoder/base/text.h"

namespace ecaudit::startup_order {
namespace {

constexpr RuleInfo kInfo{.id = "startup-order",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .title = "Steps happen in another order than expected",
                         .needs = "an expectation (startup --expect), and a capture that begins before PREOP",
                         .source = "ETG2100, init commands",
                         .doc = R"(
## What it checks
The order of the steps of one slave, and that of the slaves on the bus.

## Why it matters
Order carries meaning: PDO assignment before or after the mapping it refers to, a mode of operation before the
parameters that belong to it, SYNC0 before or after SAFEOP.

## How it is decided
The longest sequence that the expected and the observed start-up have in common counts as in place; steps that happen
with the expected value but outside of it were moved. All steps of a slave that were moved are one finding, at the
first of them. A slave that is found by its identity on the other side of its neighbours was moved; one whose position
merely counts otherwise, because another slave came or went, was not. The order of steps of different slaves is not
judged, nor that of latching receive times and distributing the system time. An ENI lists datagrams and mailbox commands
apart: each list is judged by itself.

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
      const std::string place = "position " + std::to_string(deviation.position);
      finding.title = "The expected " + SlaveText(slave) + " stands at " + place;
      finding.message = "A device with its identity stands at " + place +
                        ", on the other side of slaves that it is "
                        "expected before or behind.";
      finding.evidence.push_back(Number("expected_position", slave.position));
      finding.evidence.push_back(Number("position", deviation.position));
      return;
    }
    std::vector<std::string> steps;
    for (const startup::ExpectedStep* step : deviation.expected) steps.push_back(Noun(deviation, *step));
    const std::string expected =
        deviation.after != nullptr ? "right behind the " + Noun(deviation, *deviation.after) : "at the beginning";
    std::string actual = "at the beginning";
    if (deviation.previous != nullptr) {
      actual = "behind the " + Noun(*deviation.previous);
    } else if (deviation.next != nullptr) {
      actual = "before the " + Noun(*deviation.next);
    }
    finding.title = steps.size() == 1 ? "The " + steps.front() + " comes at another place than expected"
                                      : Count(steps.size(), "step") +
                                            " come at another place than expected, first the " + steps.front();
    finding.message = "The " + steps.front() + " is expected " + expected + ", and came " + actual + " (frame " +
                      std::to_string(deviation.frame.number) + ").";
    if (steps.size() > 1) finding.message += " Moved: " + ListText(steps) + ".";
    finding.evidence.push_back(Text("step", steps.front()));
    finding.evidence.push_back(Text("expected", expected));
    finding.evidence.push_back(Text("actual", actual));
    finding.evidence.push_back(Number("steps", static_cast<std::int64_t>(steps.size())));
    if (deviation.previous != nullptr) AddRelated(finding, deviation.previous->frame.number);
    for (std::size_t i = 1; i < deviation.actual.size(); ++i) AddRelated(finding, deviation.actual[i]->frame.number);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupOrder>};

}  // namespace
}  // namespace ecaudit::startup_order
