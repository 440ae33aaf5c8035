#include "analyzers/judge/startup_rule.h"
#include "decoder/base/text.h"

namespace ecaudit::startup_step_missing {
namespace {

constexpr RuleInfo kInfo{.id = "startup-step-missing",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .title = "A step of the expected start-up does not happen",
                         .needs = "an expectation (startup --expect), and a capture that begins before PREOP",
                         .source = "ETG2100, init commands",
                         .doc = R"(
## What it checks
Every step that the expectation lists for a slave: register writes, SDO transfers, state requests, commands to a
drive; and that every slave it lists is there.

## Why it matters
A parameter that is not set any more leaves the drive with its default, often without any error at start-up: the
machine runs with the wrong limits, modes or mapping.

## How it is decided
The expected and the observed steps of a slave are aligned; what has no counterpart is missing. Neighbouring steps of
one phase are one finding, and so is everything behind the place where a start-up stopped. The frame is the state
request that ended the phase without the step, or the last frame of the start-up. A slave that is in SAFEOP or OP when
the capture begins, or whose start-up runs into the end of a damaged capture, is not judged.

## Example
tests/rules/startup-step-missing/violates.trace

## What to do
Compare the configuration of the master with the one the expectation was saved from. If the step is no longer wanted,
save the expectation anew or take the step out of the file.
)"};

class StartupStepMissing final : public StartupRule {
 public:
  StartupStepMissing() : StartupRule(kInfo) {}

 private:
  using Kind = startup::Deviation::Kind;

  [[nodiscard]] bool Reports(Kind kind) const override { return kind == Kind::kMissing || kind == Kind::kSlaveMissing; }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    if (deviation.kind == Kind::kSlaveMissing) {
      const startup::ExpectedSlave& slave = *deviation.expected_slave;
      std::string who = "slave " + std::to_string(slave.position);
      if (!slave.name.empty()) who += " (" + Printable(slave.name) + ")";
      finding.title = "The expected " + who + " is not on the bus";
      finding.message = "No slave with its identity is left at a fitting place up to frame " +
                        std::to_string(deviation.frame.number) + ".";
      finding.evidence.push_back(Number("expected_position", slave.position));
      if (slave.vendor_id) finding.evidence.push_back(HexNumber("vendor_id", *slave.vendor_id));
      if (slave.product_code) finding.evidence.push_back(HexNumber("product_code", *slave.product_code));
      return;
    }
    std::vector<std::string> steps;
    for (const startup::ExpectedStep* step : deviation.expected) steps.push_back(Noun(deviation, *step));
    const std::string phase(Title(deviation.phase));
    if (deviation.to_the_end) {
      finding.title = "The start-up stops: " + steps.front() + " and what follows it did not happen";
      finding.message = "Up to the end of the capture, " + Count(steps.size(), "expected step") +
                        " did not happen: " + ListText(steps) + ".";
    } else {
      finding.title = (steps.size() == 1 ? steps.front() : Count(steps.size(), "step")) + " missing in " + phase;
      if (steps.size() > 1) finding.title += ", first the " + steps.front();
      finding.message = "Expected and not seen: " + ListText(steps) + ". ";
      if (deviation.next != nullptr) {
        finding.message += "The master went on with the " + Noun(*deviation.next) + " in frame " +
                           std::to_string(deviation.next->frame.number) + ".";
      } else {
        finding.message += "The start-up ended in frame " + std::to_string(deviation.frame.number) + ".";
      }
    }
    finding.message += Refusal(deviation, finding);
    finding.evidence.push_back(Text("phase", std::string(Name(deviation.phase))));
    finding.evidence.push_back(Text("expected", ListText(steps)));
    finding.evidence.push_back(Text("actual", "not sent"));
    finding.evidence.push_back(Number("steps", static_cast<std::int64_t>(steps.size())));
    if (deviation.previous != nullptr) {
      finding.evidence.push_back(Text("behind", Noun(*deviation.previous)));
      AddRelated(finding, deviation.previous->frame.number);
    }
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupStepMissing>};

}  // namespace
}  // namespace ecaudit::startup_step_missing
