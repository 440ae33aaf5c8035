#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_toggle {
namespace {

constexpr FindingKind kInRequest{
    .name = "request-toggle",
    .title = "Wrong toggle bit in a segment request[ of the {service} of {object:number}]",
    .message = R"(The segment request in {frame} has the wrong toggle bit. It belongs to the {service} of
[{object}[{?complete_access} (complete access)]][{!object}an object that is not in the capture]. The bit has to
alternate between segment requests, starting with 0.[{?several} This transfer has {wrong_segments} with a wrong toggle
bit.] A segment may have been lost or repeated, so the data are not reliable.)",
    .next = "Correct the master: repeat a segment only if its response is lost.",
    .identity = "service object"};

constexpr FindingKind kInResponse{
    .name = "response-toggle",
    .title = "Wrong toggle bit in a segment response[ of the {service} of {object:number}]",
    .message = R"(The segment response in {frame} has the wrong toggle bit. It belongs to the {service} of
[{object}[{?complete_access} (complete access)]][{!object}an object that is not in the capture]. A response has to
repeat the toggle bit of its request.[{?several} This transfer has {wrong_segments} with a wrong toggle bit.] A segment
may have been lost or repeated, so the data are not reliable.)",
    .next = "Report this frame to the vendor of the slave, unless the capture misses a segment before it.",
    .identity = "service object"};

constexpr const FindingKind* kKinds[] = {&kInRequest, &kInResponse};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sdo-abort"};

constexpr RuleInfo kInfo{.id = "sdo-toggle",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kCoe,
                         .title = "The toggle bit of an SDO segment is wrong",
                         .needs = "the segments of the transfer, without a capture gap",
                         .source = "ETG1000.6, SDO services",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Bit 4 of the command of each SDO segment:

- 0 in the first segment request, then alternating
- in a response the same as in its request

## Why it matters
A wrong bit means that a segment was lost or repeated: master and slave have different data. The slave aborts with
0x05030000.

## How it is decided
The bit of a request differs from the one expected after the last response, or the bit of a response differs from that
of its request.

- A request that is repeated because its response was lost is no error.
- If the initiate is not in the capture, the first segment in the capture sets the bit.

## Example
Two segment requests in a row with toggle bit 0, both answered.

## What to do
Correct the side that the finding names. The abort, if there is one, has this finding as its cause.
)"};

class SdoToggle final : public Rule {
 public:
  SdoToggle() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&SdoToggle::On);
    Subscribe<mailbox::MailboxMessage>(&SdoToggle::On);
  }

  /// A segment request whose frame never returned becomes known after the next ones.
  void On(const mailbox::MailboxMessage& m) {
    const bool lost = m.certainty == Certainty::kUnknown;
    if (lost && m.direction == mailbox::Direction::kOut) deferred_.Lost(m.slave, m.frame().number);
  }

  void On(const mailbox::SdoTransfer& t) {
    if (t.toggle_errors == 0) return;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
                              static_cast<std::uint64_t>(t.service) << 24U |
                              static_cast<std::uint64_t>(t.toggle_error_by) << 32U;
    const bool master = t.toggle_error_by == mailbox::Direction::kOut;
    Finding finding = Found(master ? kInRequest : kInResponse, t.slave, t.toggle_error);
    finding.Set("by", SenderValue(t.toggle_error_by))
        .Set("wrong_segments", arg::Count(t.toggle_errors, "segment"))
        .Set("segments", arg::Count(t.segments, "segment"))
        .Set("several", arg::Flag(t.toggle_errors > 1))
        .Set("service", ServiceValue(t.service));
    SetObject(finding, t, *context().slave(t.slave).profile);
    AddRelated(finding, t.request.number);
    // The abort is found by its frame once this finding is settled.
    if (t.outcome == mailbox::SdoOutcome::kAborted) AddRelated(finding, t.last.number);
    deferred_.Add({t.request.number, key, std::move(finding)});
    deferred_.SettleOld([this](DeferredFinding&& d) { Settle(std::move(d)); });
  }

  void Finish() override {
    deferred_.SettleAll([this](DeferredFinding&& d) { Settle(std::move(d)); });
    (void)NotEvaluableWithoutReturns();
  }

 private:
  void Settle(DeferredFinding&& d) {
    const SlaveId slave = d.finding.slave;
    const FrameNo abort = d.finding.related_frames.empty() ? 0 : d.finding.related_frames.back();
    FindingIndex index = Repeat(slave, d.key, d.finding.first);
    if (index == kNoFinding) index = Report(d.key, std::move(d.finding));
    ExplainFindings(context(), "sdo-abort", slave, abort, index);
  }

  DeferredFindings deferred_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoToggle>};

}  // namespace
}  // namespace ecaudit::sdo_toggle
