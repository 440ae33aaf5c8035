#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"

namespace ecaudit::al_illegal_transition {
namespace {

constexpr FindingKind kNotAllowed{
    .name = "not-allowed",
    .title = "{requested} requested in {state}: not allowed",
    .message = R"(In {frame} the master requests {requested} (AL Control {al_control}). [{!assumed}AL Status in
{state_frame} is {state}.][{?assumed}The capture has only outbound frames. If the slave followed the earlier requests,
it has been in {state} since {state_frame}.] [{!manual}The EtherCAT standard][The manual ({manual})] does not allow
this transition.[ The slave should answer with the error bit and AL status code {expected_code}.])",
    .next = "Request the states in order, and wait for each state in AL Status (0x0130).",
    .identity = "state requested"};

constexpr FindingKind kNotAllowedInAny{
    .name = "not-allowed-in-any",
    .title = "{requested} requested, allowed in none of {state}",
    .message = R"(In {frame} the master requests {requested} (AL Control {al_control}). [{!assumed}By AL Status in
{state_frame} and the later requests, the slave is in one of these states: {state}.][{?assumed}The capture has only
outbound frames. After the requests up to {state_frame} the slave may be in these states: {state}.] [{!manual}The
EtherCAT standard][The manual ({manual})] allows this transition in none of them.[ The slave should answer with the
error bit and AL status code {expected_code}.])",
    .next = "Request the states in order, and wait for each state in AL Status (0x0130).",
    .identity = "state requested"};

constexpr const FindingKind* kKinds[] = {&kNotAllowed, &kNotAllowedInAny};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"al-error-standing"};

constexpr RuleInfo kInfo{.id = "al-illegal-transition",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kAlRequest,
                         .title = "The master requests a state that its slave cannot enter from its state",
                         .needs = "the AL state of the slave before the request",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Each write of AL Control (0x0120) against the transitions that the manual of the drive family allows. For slaves without
a family, the EtherCAT standard applies:

- upwards INIT, PREOP, SAFEOP, OP, one step at a time
- downwards also several steps at once
- BOOT only from INIT

## Why it matters
The slave answers with the error bit and AL status code 0x0011 and keeps its state. Every later step of the master
fails.

## How it is decided
The state is the one last read from AL Status (0x0130), together with the states that later requests may have led to.
The rule reports a request that none of these states allows. It reports nothing:

- if no state was read yet
- for requests of INIT, and of the state in which the slave is
- for a request that the slave did not accept (working counter 0)
- for a request after a long pause that may be a capture gap

In a capture without returned frames, the rule assumes that the slave followed earlier requests. Such a finding is
marked inferred.

## Example
samples/captures/init-to-op-refused.pcapng: OP is requested in INIT.

## What to do
Request the states in order. Wait until AL Status shows each state before requesting the next.
)"};

class AlIllegalTransition final : public Rule {
 public:
  AlIllegalTransition() : Rule(kInfo) { Subscribe<model::AlRequestJudged>(&AlIllegalTransition::On); }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    if (request.verdict == model::AlVerdict::kUnknown) {
      if (request.possible.empty()) {
        NotEvaluable(e.slave, ReasonCode::kNotRead, what::kAlStateBefore, request.frame.number);
      } else {
        NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kAlState, request.frame.number);
      }
      return;
    }
    if (request.verdict != model::AlVerdict::kIllegal) return;
    FindingIndex index = Repeat(e.slave, RequestKey(request), request.frame);
    if (index == kNoFinding) index = Report(RequestKey(request), Describe(e));
    context().ExplainRequest(e.slave, request.frame.number, index);
  }

 private:
  Finding Describe(const model::AlRequestJudged& e) const {
    const model::AlRequestRecord& request = e.request;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const std::vector<Value> states = StatesOf(request.possible);
    Finding finding = Found(states.size() == 1 ? kNotAllowed : kNotAllowedInAny, e.slave, request.frame);
    finding.Set("state", states.size() == 1 ? states.front() : arg::List(states))
        .Set("requested", arg::State(request.control.state()))
        .Set("al_control", arg::Hex(request.control.raw))
        .Set("state_frame", arg::Frame(e.from_since));
    if (request.assumed) finding.Set("assumed", arg::Flag());
    SetManual(finding, family);
    if (const device::AlTransition* row = request.transition) {
      if (!row->refusal_codes.empty()) finding.Set("expected_code", CodeValue(row->refusal_codes.front(), family));
      finding.reference = ReferenceTo(row->source);
    }
    finding.confidence = request.assumed ? Confidence::kInferred : Confidence::kObserved;
    AddRelated(finding, e.from_since);
    return finding;
  }

  static std::vector<Value> StatesOf(model::StateSet states) {
    std::vector<Value> values;
    for (const std::uint8_t state :
         {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}, std::uint8_t{4}, std::uint8_t{8}}) {
      if (states.contains(state)) values.push_back(arg::State(state));
    }
    return values;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlIllegalTransition>};

}  // namespace
}  // namespace ecaudit::al_illegal_transition
