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
drive; that every slave it lists is there; and, where it says so ("outcome": "done"), that the slave followed: the
state was reached, the transfer answered, the register taken, the drive enabled.

## Why it matters
A parameter that is not set any more leaves the drive with its default, often without any error at start-up: the
machine runs with the wrong limits, modes or mapping. A step that is done and fails comes to the same.

## How it is decided
The expected and the observed steps of a slave are aligned; what has no counterpart is missing. Neighbouring steps of
one phase are one finding, and so is everything behind the place where a start-up stopped. The frame is the state
request that ended the phase without the step, or the last frame of the start-up. A slave that is in SAFEOP or OP when
the capture begins, or whose start-up runs into the end of a damaged capture, is not judged.

A step that has to succeed failed where the slave refused or aborted it, or where the master looked for the state or the
answer for a while and then went on, or looked no more although the capture goes on; a drive where it shows a fault, or
does not show Operation enabled within a second. A step done again with success counts. What did not come about behind
a state that was not reached is told with it. Where the capture ends before, or nobody looks, nothing is judged. A
second start-up in the same capture is not compared, which the report says.

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

  [[nodiscard]] bool Reports(Kind kind) const override {
    return kind == Kind::kMissing || kind == Kind::kSlaveMissing || kind == Kind::kFailed;
  }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    if (deviation.kind == Kind::kSlaveMissing) {
      const startup::ExpectedSlave& slave = *deviation.expected_slave;
      finding.title = "The expected " + SlaveText(slave) + " is not on the bus";
      finding.message = "No slave with its identity is left at a fitting place in the whole capture.";
      finding.evidence.push_back(Number("expected_position", slave.position));
      if (slave.vendor_id) finding.evidence.push_back(HexNumber("vendor_id", *slave.vendor_id));
      if (slave.product_code) finding.evidence.push_back(HexNumber("product_code", *slave.product_code));
      return;
    }
    if (deviation.kind == Kind::kFailed) return DescribeFailed(deviation, finding);
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

  void DescribeFailed(const startup::Deviation& deviation, Finding& finding) const {
    const StartupStep& step = *deviation.actual.front();
    const std::string what = Noun(step) + " was " + step.note;
    finding.title = "The " + what;
    finding.message = "The master sent it in frame " + std::to_string(step.frame.number) + ". ";
    if (step.last.number == step.frame.number) {
      finding.message += "It was " + step.note + ".";
    } else {
      finding.message += (step.outcome == StartupOutcome::kUnanswered ? "Up to frame " : "In frame ") +
                         std::to_string(step.last.number) + " it was " + step.note + ".";
    }
    finding.message += " Expected is that it succeeds.";
    std::vector<std::string> further, behind;
    for (std::size_t i = 1; i < deviation.actual.size(); ++i) {
      further.push_back("the " + Noun(*deviation.actual[i]) + " was " + deviation.actual[i]->note);
      AddRelated(finding, deviation.actual[i]->frame.number);
    }
    for (const startup::ExpectedStep* missing : deviation.behind) behind.push_back(Noun(deviation, *missing));
    if (!further.empty()) finding.message += " Behind it, " + ListText(further) + ".";
    if (!behind.empty()) finding.message += " What is expected behind it did not happen: " + ListText(behind) + ".";
    finding.evidence.push_back(Text("phase", std::string(Name(deviation.phase))));
    finding.evidence.push_back(Text("step", Noun(step)));
    finding.evidence.push_back(Text("expected", "done"));
    finding.evidence.push_back(Text("actual", step.note));
    if (step.code != 0) finding.evidence.push_back(HexNumber("code", step.code));
    if (step.last.number != step.frame.number) AddRelated(finding, step.last.number);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupStepMissing>};

}  // namespace
}  // namespace ecaudit::startup_step_missing
