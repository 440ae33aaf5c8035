#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"

namespace ecaudit::al_accepted_illegal {
namespace {

constexpr FindingKind kAccepted{
    .name = "accepted",
    .title =
        "Slave goes from {state_before} to {requested}, not allowed by [{?manual}its manual][{!manual}the EtherCAT "
        "standard]",
    .message = R"(The master requested {requested} (AL Control {al_control}) in {request_frame}, while the slave was
in {state_before}. AL Status in {frame} is {al_status:number} ({al_status}): the slave accepted the request.
[{!manual}The EtherCAT standard][The manual ({manual})] does not allow this transition. Another slave or firmware may
refuse it.)",
    .next = "Correct the order of the requests in the master.",
    .identity = "state_before requested"};

constexpr const FindingKind* kKinds[] = {&kAccepted};

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"al-invalid-request"};

constexpr RuleInfo kInfo{.id = "al-accepted-illegal",
                         .group = "AL state machine",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .subject = Subject::kAlRequest,
                         .title = "The slave performs a transition that its manual does not allow",
                         .needs = "the AL state before and after the request",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether a slave reaches a requested state, without the error bit, although the manual of its family does not allow the
transition. Slaves without a family are compared with the EtherCAT standard.

## Why it matters
The start-up works with this firmware. It fails with another slave or version that follows the manual.

## How it is decided
The master read both states from AL Status, and only the illegal request is between these reads. The rule reports
nothing if a request was lost on its way, or if several requests have no read between them.

## Example
samples/captures/accepted-illegal.pcapng

## What to do
Correct the order of the requests in the master. If the manual is wrong, report that to the vendor.
)"};

class AlAcceptedIllegal final : public Rule {
 public:
  AlAcceptedIllegal() : Rule(kInfo) { Subscribe<model::AlAnswered>(&AlAcceptedIllegal::On); }

  void On(const model::AlAnswered& e) {
    if (e.outcome != model::AlAnswered::Outcome::kAcceptedIllegal || e.request.from == 0) return;
    if (Repeat(e.slave, RequestKey(e.request), e.frame) != kNoFinding) return;
    Finding finding = Found(kAccepted, e.slave, e.frame);
    finding.Set("state_before", arg::State(e.request.from))
        .Set("requested", arg::State(e.request.control.state()))
        .Set("al_status", arg::Status(e.status.raw))
        .Set("al_control", arg::Hex(e.request.control.raw))
        .Set("request_frame", arg::Frame(e.request.frame.number));
    SetManual(finding, *context().slave(e.slave).profile);
    finding.caused_by = context().ExplanationOf(e.slave, e.request.frame.number);
    if (e.request.transition != nullptr) finding.reference = ReferenceTo(e.request.transition->source);
    AddRelated(finding, e.request.frame.number);
    Report(RequestKey(e.request), std::move(finding));
  }
  void Finish() override { NotEvaluableWhereRequestsAreNotFollowed(); }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlAcceptedIllegal>};

}  // namespace
}  // namespace ecaudit::al_accepted_illegal
