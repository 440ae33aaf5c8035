#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/startup_rule.h"

namespace ecaudit::startup_step_missing {
namespace {

constexpr FindingKind kSlaveMissing{
    .name = "slave-missing",
    .title = "The expected {expected_slave} is not on the bus",
    .message =
        R"(No slave in the capture has its identity and a fitting position.[ Expected: vendor ID {vendor_id}, product code
{product_code}.])",
    .next = "Check its power and cable, or save the expectation again.",
    .identity = "expected_position"};
constexpr FindingKind kStopped{
    .name = "stopped",
    .title = "Start-up stops before: {step}",
    .message = "{steps} did not happen up to the end of the capture: {expected}[ and {more}].",
    .next = "Find out why the master stopped there: read the step before it and the answer of the slave.",
    .identity = "phase step"};
constexpr FindingKind kMissing{
    .name = "missing",
    .title = "[{?one}{step}][{!one}{steps}] missing in {phase}[{!one}, first the {step}]",
    .message =
        R"(Expected, but not in the capture: {expected}[ and {more}].[ The master continued with the {next_step} in
{next_frame}.][{!next_step} The start-up ended in {frame}.])",
    .next = "Compare the master's configuration with the one that the expectation was saved from.",
    .identity = "phase step"};
constexpr FindingKind kFailed{
    .name = "failed",
    .title = "The {step} was {actual}",
    .message = R"(The master sent it in {sent_frame}. [Up to {until_frame}, it was {actual}.][In {answer_frame} it was
{actual}.][{?at_once}It was {actual}.] The expectation requires that it succeeds.)",
    .next = "Correct what the slave refuses; `ecaudit check` names the reason where it is known.",
    .identity = "phase step code"};
constexpr const FindingKind* kKinds[] = {&kSlaveMissing, &kStopped, &kMissing, &kFailed};

constexpr NoteKind kFurther{.name = "failed-after", .text = "The {step} after it ({at}) was {outcome}."};
constexpr NoteKind kNotReached{.name = "not-reached",
                               .text = "These expected steps after it did not happen: {expected}[ and {more}]."};
constexpr const NoteKind* kNotes[] = {&kFurther, &kNotReached, &kRequestFailed};

constexpr Word kNotSent{"not sent", "not sent"}, kDone{"done", "done"};

constexpr RuleInfo kInfo{.id = "startup-step-missing",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "A step of the expected start-up does not happen",
                         .needs = "an expectation (startup --expect), and a capture that begins before PREOP",
                         .source = "ETG2100, init commands",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Every step that the expectation lists for a slave: register writes, SDO transfers, state requests, commands to a drive.
Every slave that it lists must be on the bus. Where the expectation has "outcome": "done", the slave must have
followed: the state was reached, the transfer answered, the register accepted, the drive enabled.

## Why it matters
A parameter that is no longer set leaves the drive with its default, often without any error at start-up. The machine
runs with wrong limits, modes or mapping. A step that is sent and fails has the same effect.

## How it is decided
The expected and the observed steps of a slave are aligned. A step without a counterpart is missing.

- Neighbouring steps of one phase are one finding, and so is everything after the place where a start-up stopped.
- The frame is the state request that ended the phase without the step, or the last frame of the start-up.
- Not evaluated: a slave that is in SAFEOP or OP when the capture begins, or whose start-up runs into the end of a
  damaged capture.
- A step failed if the slave refused or aborted it, or if the master polled for the state or the answer and then went
  on. A drive failed if it shows a fault, or does not show Operation enabled within a second. A later success counts.
- Steps that did not happen because a state was not reached are listed with the failed step.
- If the capture ends before, or the master does not poll, the step is not evaluated.
- A second start-up in the same capture is not compared; the report names it.

## Example
tests/rules/startup-step-missing/violates.trace

## What to do
Compare the configuration of the master with the one that the expectation was saved from. If the step is no longer
wanted, save the expectation again or remove the step from the file.
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
      finding.kind = &kSlaveMissing;
      finding.Set("expected_position", arg::Number(slave.position))
          .Set("expected_slave", arg::Text(SlaveText(slave, context().names())));
      if (slave.vendor_id) finding.Set("vendor_id", arg::Hex(*slave.vendor_id, 8));
      if (slave.product_code) finding.Set("product_code", arg::Hex(*slave.product_code, 8));
      return;
    }
    if (deviation.kind == Kind::kFailed) return DescribeFailed(deviation, finding);
    std::vector<std::string> steps;
    for (const startup::ExpectedStep* step : deviation.expected) steps.push_back(Noun(deviation, *step));
    finding.kind = deviation.to_the_end ? &kStopped : &kMissing;
    finding.Set("phase", PhaseValue(deviation.phase));
    SetSteps(finding, "expected", "more", steps);
    finding.Set("actual", arg::Of(kNotSent))
        .Set("steps", arg::Count(steps.size(), "step"))
        .Set("step", arg::Text(steps.front()))
        .Set("one", arg::Flag(steps.size() == 1));
    if (deviation.next != nullptr && !deviation.to_the_end) {
      finding.Set("next_step", arg::Text(Noun(*deviation.next)))
          .Set("next_frame", arg::Frame(deviation.next->frame.number));
    }
    AddRefusal(deviation, finding);
    if (deviation.previous != nullptr) {
      finding.Set("after", arg::Text(Noun(*deviation.previous)));
      AddRelated(finding, deviation.previous->frame.number);
    }
  }

  void DescribeFailed(const startup::Deviation& deviation, Finding& finding) const {
    const StartupStep& step = *deviation.actual.front();
    finding.kind = &kFailed;
    finding.Set("phase", PhaseValue(deviation.phase))
        .Set("step", arg::Text(Noun(step)))
        .Set("expected", arg::Of(kDone))
        .Set("actual", arg::Text(step.note))
        .Set("sent_frame", arg::Frame(step.frame.number));
    if (step.code != 0) finding.Set("code", arg::Hex(step.code));
    const bool at_once = step.last.number == step.frame.number;
    finding.Set("at_once", arg::Flag(at_once));
    if (!at_once) {
      finding.Set(step.outcome == StartupOutcome::kUnanswered ? "until_frame" : "answer_frame",
                  arg::Frame(step.last.number));
    }
    for (std::size_t i = 1; i < deviation.actual.size(); ++i) {
      const StartupStep& further = *deviation.actual[i];
      finding.Add(kFurther, {{"step", arg::Text(Noun(further))},
                             {"outcome", arg::Text(further.note)},
                             {"at", arg::Frame(further.frame.number)}});
      AddRelated(finding, further.frame.number);
    }
    std::vector<std::string> not_reached;
    for (const startup::ExpectedStep* missing : deviation.behind) not_reached.push_back(Noun(deviation, *missing));
    if (!not_reached.empty()) {
      Finding list;
      SetSteps(list, "expected", "more", not_reached);
      finding.Add(kNotReached, list.arguments);
    }
    if (step.last.number != step.frame.number) AddRelated(finding, step.last.number);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupStepMissing>};

}  // namespace
}  // namespace ecaudit::startup_step_missing
