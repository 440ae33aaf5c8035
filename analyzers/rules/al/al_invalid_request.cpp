#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::al_invalid_request {
namespace {

constexpr FindingKind kNoSuchState{
    .name = "no-such-state",
    .title = "AL Control {al_control} requests {requested}, which does not exist",
    .message =
        R"(In {frame} the master writes {al_control} to AL Control (0x0120). Bits 3-0 must be 1 (INIT), 2 (PREOP), 3
(BOOT), 4 (SAFEOP) or 8 (OP). By the EtherCAT standard the slave keeps its state and refuses the request with AL
status code 0x0012 (unknown requested state).)",
    .next = "Correct the value in the master.",
    .identity = "requested"};

constexpr const FindingKind* kKinds[] = {&kNoSuchState};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"al-illegal-transition"};

constexpr RuleInfo kInfo{.id = "al-invalid-request",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .subject = Subject::kAlRequest,
                         .title = "The master requests a value that is no AL state",
                         .needs = "nothing",
                         .source = "ETG1000.6, AL Control register 0x0120",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Bits 3-0 of each write of AL Control (0x0120): 1 INIT, 2 PREOP, 3 BOOT, 4 SAFEOP, 8 OP. Every other value is undefined.

## Why it matters
The slave refuses it with AL status code 0x0012 and keeps its state.

## How it is decided
From the written bytes alone. The rule reports nothing:

- if the slave did not accept the write (working counter 0, or the frame never returned)
- for a broadcast that writes 0, as masters clear registers when they scan the bus

## Example
samples/captures/invalid-request.pcapng: AL Control 0x0005.

## What to do
Correct the value in the master. Several states cannot be requested at once.
)"};

class AlInvalidRequest final : public Rule {
 public:
  AlInvalidRequest() : Rule(kInfo) { Subscribe<model::AlRequestJudged>(&AlInvalidRequest::On); }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    if (request.verdict != model::AlVerdict::kInvalid || (e.broadcast && request.control.raw == 0)) return;
    FindingIndex index = Repeat(e.slave, request.control.state(), request.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kNoSuchState, e.slave, request.frame);
      finding.Set("al_control", arg::Hex(request.control.raw)).Set("requested", arg::State(request.control.state()));
      finding.confidence = request.assumed ? Confidence::kInferred : Confidence::kObserved;
      index = Report(request.control.state(), std::move(finding));
    }
    context().ExplainRequest(e.slave, request.frame.number, index);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlInvalidRequest>};

}  // namespace
}  // namespace ecaudit::al_invalid_request
