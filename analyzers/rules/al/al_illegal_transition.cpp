#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_illegal_transition {
namespace {

constexpr RuleInfo kInfo{.id = "al-illegal-transition",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .subject = Subject::kAlRequest,
                         .title = "The master requests a state that cannot be reached from the slave's state",
                         .needs = "the AL state of the slave before the request",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .doc = R"(
## What it checks
Each write of AL Control (0x0120) against the transitions that the manual of the drive family allows; for slaves without
a family, those of the EtherCAT standard: INIT-PREOP-SAFEOP-OP upwards one step at a time, downwards also several at
once, BOOT only from INIT.

## Why it matters
The slave answers with the error bit and AL status code 0x0011 and stays where it is; everything the master does after
that fails.

## How it is decided
The state is the one last read from AL Status (0x0130), together with what requests since then may have led to. The rule
fires when the request is allowed from none of them. It is silent while no state was read yet, for requests of INIT and
of the state the slave is in, for a request the slave did not take (working counter 0), and for one behind a long
silence that may be a hole in the capture. In a capture without returned frames the slave is assumed to have followed
earlier requests; such a finding is marked inferred.

## Example
samples/captures/init-to-op-refused.pcapng: OP is requested in INIT.

## What to do
Request the states in order and wait for each to be shown in AL Status before requesting the next.
)"};

class AlIllegalTransition final : public Rule {
 public:
  AlIllegalTransition() : Rule(kInfo) { Subscribe<model::AlRequestJudged>(&AlIllegalTransition::On); }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    if (request.verdict == model::AlVerdict::kUnknown) {
      NotEvaluable(e.slave,
                   request.possible.empty()
                       ? "the state of the slave was not read before the request"
                       : "between the last look at the state and the request nobody sent anything for long: what "
                         "happened meanwhile may not be in the capture",
                   request.frame.number);
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
    const std::string to = esc::StateName(request.control.state());
    const std::string from = StatesText(request.possible);
    const std::string frame = std::to_string(e.from_since);
    Finding finding;
    finding.slave = e.slave;
    finding.first = request.frame;
    finding.title = to + " requested in " + from + ": not allowed";
    finding.message = "The master writes " + RequestText(request);
    if (request.assumed) {
      finding.message += "; if the slave followed the requests before, it is in " + from + " since frame " + frame +
                         " (only outbound frames are captured). ";
    } else if (request.from != 0) {
      finding.message += " while the slave is in " + from + " (AL Status in frame " + frame + "). ";
    } else {
      finding.message +=
          "; after AL Status in frame " + frame + " and the requests since then the slave is in " + from + ". ";
    }
    finding.message += LawText(family) + " does not allow this transition";
    if (const device::AlTransition* row = request.transition) {
      if (!row->refusal_codes.empty()) {
        finding.message += "; the slave is to answer with the error bit and AL status code " +
                           CodeText(row->refusal_codes.front(), family);
      }
      finding.reference = ReferenceTo(row->source);
    }
    finding.message += ". Request the states in order and wait for each in AL Status.";
    finding.evidence.push_back(Text("state", from));
    finding.evidence.push_back(Text("requested", to));
    finding.evidence.push_back(HexNumber("al_control", request.control.raw));
    finding.confidence = request.assumed ? Confidence::kInferred : Confidence::kObserved;
    AddRelated(finding, e.from_since);
    return finding;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlIllegalTransition>};

}  // namespace
}  // namespace ecaudit::al_illegal_transition
