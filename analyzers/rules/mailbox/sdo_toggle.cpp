#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_toggle {
namespace {

constexpr RuleInfo kInfo{.id = "sdo-toggle",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .subject = Subject::kCoe,
                         .title = "The toggle bit of an SDO segment is wrong",
                         .needs = "the segments of the transfer, without a gap",
                         .source = "ETG1000.6, SDO services",
                         .doc = R"(
## What it checks
Bit 4 of the command of each SDO segment: 0 in the first segment request, then alternating; the answer repeats it.

## Why it matters
A wrong bit means that a segment was lost or came twice: the data are not what the other side has. The slave aborts with
0x05030000.

## How it is decided
The bit of a request differs from what follows the last answer, or that of an answer from its request. A request
repeated because its answer was lost is no error. Where the initiate is not in the capture, the first segment seen sets
the bit.

## Example
Two segment requests in a row with toggle 0, both answered.

## What to do
Correct the side that the finding names. Its abort, if there is one, points here.
)"};

class SdoToggle final : public Rule {
 public:
  SdoToggle() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&SdoToggle::On);
    Subscribe<mailbox::MailboxMessage>(&SdoToggle::On);
  }

  /// A segment request whose frame never came back becomes known after the next ones.
  void On(const mailbox::MailboxMessage& m) {
    const bool lost = m.certainty == Certainty::kUnknown;
    if (lost && m.direction == mailbox::Direction::kOut) deferred_.Lost(m.slave, m.frame().number);
  }

  void On(const mailbox::SdoTransfer& t) {
    if (t.toggle_errors == 0) return;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
                              static_cast<std::uint64_t>(t.service) << 24U |
                              static_cast<std::uint64_t>(t.toggle_error_by) << 32U;
    const std::string object =
        t.has_object ? ObjectText(t, *context().slave(t.slave).profile) : std::string("an object not in the capture");
    const bool master = t.toggle_error_by == mailbox::Direction::kOut;
    Finding finding;
    finding.slave = t.slave;
    finding.first = t.toggle_error;
    finding.title = "Wrong toggle bit in the " + std::string(Name(t.service)) + " of " + object;
    finding.message = "The segment " + WhichWay(t.toggle_error_by) + " in frame " +
                      std::to_string(t.toggle_error.number) + ", part of the " + std::string(Name(t.service)) + " of " +
                      object + ", has the wrong toggle bit" +
                      (master ? ": it has to alternate from one segment request to the next, beginning with 0."
                              : ": an answer has to repeat the bit of its request.");
    if (t.toggle_errors > 1) {
      finding.message += " It is the first of " + std::to_string(t.toggle_errors) + " in this transfer.";
    }
    finding.message += " A segment was lost or repeated, so the data cannot be trusted.";
    finding.evidence.push_back(Text("by", master ? "master" : "slave"));
    finding.evidence.push_back(Number("wrong_segments", t.toggle_errors));
    finding.evidence.push_back(Number("segments", t.segments));
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
