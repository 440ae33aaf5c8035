#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_error_not_acknowledged {
namespace {

constexpr RuleInfo kInfo{.id = "al-error-not-acknowledged",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .subject = Subject::kAlRequest,
                         .title = "A state is requested while the error bit is set, without acknowledging it",
                         .needs = "AL Status with the error bit before the request",
                         .source = "ETG1000.6, AL Control register 0x0120 bit 4",
                         .doc = R"(
## What it checks
Requests for a state other than INIT while AL Status shows the error bit: they must carry the acknowledge bit (bit 4 of
AL Control). INIT acknowledges by itself.

## Why it matters
The slave ignores the request without any answer. The master waits, times out and often blames the slave.

## How it is decided
The error bit was read, no request since then acknowledged it, and the slave took this one. An error that is only the
echo of an acknowledge (slaves without a processor) does not count.

## Example
samples/captures/refusal-never-acknowledged.pcapng

## What to do
Read the AL status code, remove its cause, then write the current state with bit 4 set (for example 0x0012 in PREOP),
or write INIT.
)"};

class AlErrorNotAcknowledged final : public Rule {
 public:
  AlErrorNotAcknowledged() : Rule(kInfo) { Subscribe<model::AlRequestJudged>(&AlErrorNotAcknowledged::On); }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    if (request.verdict == model::AlVerdict::kUnknown && !request.control.bit4()) {
      NotEvaluable(e.slave, "AL Status was not read before the request", request.frame.number);
    }
    if (request.verdict != model::AlVerdict::kNeedsAcknowledge) return;
    FindingIndex index = Repeat(e.slave, e.error_since, request.frame);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = e.slave;
      finding.first = request.frame;
      finding.title = esc::StateName(request.control.state()) + " requested without acknowledging the error";
      finding.message = "AL Status shows the error bit since frame " + std::to_string(e.error_since) +
                        ", and the master writes " + RequestText(request) +
                        " without the acknowledge bit (bit 4). The slave ignores such a request and does not answer. "
                        "Read the AL status code, remove its cause, then set bit 4 of AL Control or request INIT.";
      finding.confidence = request.assumed ? Confidence::kInferred : Confidence::kObserved;
      finding.evidence.push_back(HexNumber("al_control", request.control.raw));
      finding.evidence.push_back(Text("requested", esc::StateName(request.control.state())));
      finding.evidence.push_back(Number("error_bit_since_frame", static_cast<std::int64_t>(e.error_since)));
      AddRelated(finding, e.error_since);
      index = Report(e.error_since, std::move(finding));
    } else {
      AddRelated(context().store[index], request.frame.number);
    }
    context().ExplainRequest(e.slave, request.frame.number, index);
  }
  void Finish() override { NotEvaluableWithoutReturns(); }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlErrorNotAcknowledged>};

}  // namespace
}  // namespace ecaudit::al_error_not_acknowledged
