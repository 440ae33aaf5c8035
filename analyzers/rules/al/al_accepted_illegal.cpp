#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_accepted_illegal {
namespace {

constexpr RuleInfo kInfo{.id = "al-accepted-illegal",
                         .group = "AL state machine",
                         .severity = Severity::kWarning,
                         .subject = Subject::kAlRequest,
                         .title = "The slave performs a transition that its manual does not allow",
                         .needs = "the AL state before and after the request",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .doc = R"(
## What it checks
Whether a slave reaches a requested state, without error bit, although the manual of its family (else the standard)
does not allow the transition.

## Why it matters
The start-up works with this firmware and will fail with another slave or version that follows its manual.

## How it is decided
Both states were read from AL Status and only the illegal request lies between them. Where a request was lost on its
way, or several were made without a read between them, the rule is silent.

## Example
samples/captures/accepted-illegal.pcapng

## What to do
Correct the order of the requests in the master; tell the vendor if the manual is wrong.
)"};

class AlAcceptedIllegal final : public Rule {
 public:
  AlAcceptedIllegal() : Rule(kInfo) { Subscribe<model::AlAnswered>(&AlAcceptedIllegal::On); }

  void On(const model::AlAnswered& e) {
    if (e.outcome != model::AlAnswered::Outcome::kAcceptedIllegal || e.request.from == 0) return;
    if (Repeat(e.slave, RequestKey(e.request), e.frame) != kNoFinding) return;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title = "Slave goes from " + TransitionText(e.request) + ", which its manual does not allow";
    if (JudgedByStandard(family))
      finding.title = "Slave goes from " + TransitionText(e.request) + ", which is not allowed";
    finding.message = "The master requested " + RequestText(e.request) + " in " + esc::StateName(e.request.from) +
                      " (frame " + std::to_string(e.request.frame.number) + "), and the slave is in " +
                      esc::StateName(e.status.state()) + " in frame " + std::to_string(e.frame.number) + ". " +
                      LawText(family) +
                      " does not allow this transition, so another slave or firmware may refuse it. Correct the order "
                      "of the requests in the master.";
    finding.evidence.push_back(Text("state_before", esc::StateName(e.request.from)));
    finding.evidence.push_back(HexNumber("al_status", e.status.raw));
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
