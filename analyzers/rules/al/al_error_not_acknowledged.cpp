#include <map>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/words/what.h"

namespace ecaudit::al_error_not_acknowledged {
namespace {

constexpr FindingKind kNotAcknowledged{
    .name = "not-acknowledged",
    .title = "{requested} requested while the error bit is set, without acknowledge",
    .message =
        R"(AL Status shows the error bit from {error_bit_since_frame} on. In {frame} the master requests {requested}
(AL Control {al_control}) without the acknowledge bit (bit 4). The slave ignores such a request and does not answer.)",
    .next = "Read the AL status code (0x0134) and remove its cause. Then set bit 4 of AL Control, or request INIT.",
    .identity = "requested"};

constexpr const FindingKind* kKinds[] = {&kNotAcknowledged};

constexpr RuleInfo kInfo{.id = "al-error-not-acknowledged",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kAlRequest,
                         .title = "The master requests a state without acknowledging the error bit",
                         .needs = "AL Status with the error bit before the request",
                         .source = "ETG1000.6, AL Control register 0x0120 bit 4",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Requests of a state other than INIT while AL Status shows the error bit. They must carry the acknowledge bit (bit 4 of
AL Control). A request of INIT acknowledges by itself.

## Why it matters
The slave ignores the request without any answer. The master waits, times out and often blames the slave.

## How it is decided
- The master read the error bit.
- No request since then acknowledged it.
- The slave accepted this request (its working counter is not 0).
- Bit 4 acknowledges by its positive edge. A request of the same state with bit 4 = 0 after 1 prepares that edge. It is
  reported if the next request lacks bit 4 or no request follows.

The echo of an acknowledge (slaves without a processor) is no error.

## Example
samples/captures/refusal-never-acknowledged.pcapng

## What to do
Read the AL status code and remove its cause. Then write the current state with bit 4 set (for example 0x0012 in PREOP),
or write INIT.
)"};

class AlErrorNotAcknowledged final : public Rule {
 public:
  AlErrorNotAcknowledged() : Rule(kInfo) { Subscribe<model::AlRequestJudged>(&AlErrorNotAcknowledged::On); }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    if (request.verdict == model::AlVerdict::kUnknown && !request.control.bit4()) {
      NotEvaluable(e.slave, ReasonCode::kNotRead, what::kAlStateBefore, request.frame.number);
    }
    // The write of bit 4 = 0 was the first half of an acknowledge.
    if (const auto held = held_.find(e.slave); held != held_.end()) {
      const model::AlRequestJudged first = held->second;
      held_.erase(held);
      if (!request.control.bit4()) ReportRequest(first);
    }
    if (request.verdict != model::AlVerdict::kNeedsAcknowledge) return;
    const bool repeats =
        request.before && request.before->bit4() &&
        (request.control.state() == request.before->state() || request.control.state() == request.from);
    if (repeats) {
      held_.emplace(e.slave, e);
      return;
    }
    ReportRequest(e);
  }
  void Finish() override {
    for (const auto& [slave, held] : held_) ReportRequest(held);
    NotEvaluableWithoutReturns();
  }

 private:
  void ReportRequest(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    FindingIndex index = Repeat(e.slave, e.error_since, request.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kNotAcknowledged, e.slave, request.frame);
      finding.Set("al_control", arg::Hex(request.control.raw))
          .Set("requested", arg::State(request.control.state()))
          .Set("error_bit_since_frame", arg::Frame(e.error_since));
      finding.confidence = request.assumed ? Confidence::kInferred : Confidence::kObserved;
      AddRelated(finding, e.error_since);
      index = Report(e.error_since, std::move(finding));
    } else {
      AddRelated(context().store[index], request.frame.number);
    }
    context().ExplainRequest(e.slave, request.frame.number, index);
  }

  std::map<SlaveId, model::AlRequestJudged> held_;  // bit 4 went to 0: the edge may follow
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlErrorNotAcknowledged>};

}  // namespace
}  // namespace ecaudit::al_error_not_acknowledged
