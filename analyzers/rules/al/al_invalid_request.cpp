#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_invalid_request {
namespace {

constexpr RuleInfo kInfo{.id = "al-invalid-request",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .subject = Subject::kAlRequest,
                         .title = "The master requests a value that is no AL state",
                         .needs = "nothing",
                         .source = "ETG1000.6, AL Control register 0x0120",
                         .doc = R"(
## What it checks
Bits 3-0 of each write of AL Control (0x0120): 1 INIT, 2 PREOP, 3 BOOT, 4 SAFEOP, 8 OP; every other value is undefined.

## Why it matters
The slave refuses it with AL status code 0x0012 and keeps its state.

## How it is decided
From the written bytes alone. It is silent when the slave did not take the write (working counter 0, or the frame never
came back), and for a broadcast that writes 0, as masters blank registers at scan time.

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
      Finding finding;
      finding.slave = e.slave;
      finding.first = request.frame;
      finding.title = "AL Control " + Hex(request.control.raw) + " requests " +
                      esc::StateName(request.control.state()) + ", which does not exist";
      finding.message =
          "The master writes " + Hex(request.control.raw) +
          " to AL Control (0x0120). Bits 3-0 must be 1 (INIT), 2 (PREOP), 3 (BOOT), 4 (SAFEOP) or 8 (OP); "
          "by the standard the slave keeps its state and refuses with AL status code 0x0012 (unknown "
          "requested state). Correct the value in the master.";
      finding.evidence.push_back(HexNumber("al_control", request.control.raw));
      finding.confidence = request.assumed ? Confidence::kInferred : Confidence::kObserved;
      index = Report(request.control.state(), std::move(finding));
    }
    context().ExplainRequest(e.slave, request.frame.number, index);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlInvalidRequest>};

}  // namespace
}  // namespace ecaudit::al_invalid_request
