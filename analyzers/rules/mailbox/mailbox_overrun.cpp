#include <map>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::mailbox_overrun {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-overrun",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .title = "A request is written while the one before is still in the mailbox",
                         .needs = "the working counter of the write, and the request before",
                         .source = "ESC-1, mailbox",
                         .doc = R"(
## What it checks
Writes of a mailbox message that the sync manager refuses (working counter 0) because the message before has not been
taken out by the slave yet.

## Why it matters
A mailbox holds one message. The refused one is lost unless the master notices and writes it again.

## How it is decided
The write came back with working counter 0, the mailbox is switched on, and a request is outstanding. The same message
again, byte for byte, is a repetition after a time-out and no overrun. Where the outstanding request was never answered,
caused_by names mailbox-no-response: the slave stopped taking messages.

## Example
samples/captures/mailbox-no-response.pcapng: the second request comes back with working counter 0.

## What to do
Wait for the answer, or until sync manager 0 shows the mailbox empty (0x0805 bit 3), before the next message is written.
)"};

class MailboxOverrun final : public Rule {
 public:
  MailboxOverrun() : Rule(kInfo) { Hear<mailbox::MailboxRefused>(&MailboxOverrun::On); }

  void On(const mailbox::MailboxRefused& e) {
    if (e.same_as_last || e.off) return;
    const model::StateSet possible = context().slave(e.slave).al.possible();
    if (possible.single() == static_cast<std::uint8_t>(esc::AlState::INIT)) return;  // mailbox-not-active
    if (!e.outstanding.frame.seen()) {
      NotEvaluable(e.slave, "a refused mailbox write, and the message that fills the mailbox is not in the capture",
                   e.frame().number);
      return;
    }
    const std::uint64_t key = RequestKey(e.outstanding);
    if (Repeat(e.slave, key, e.frame()) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame();
    finding.title = Name(e.header.protocol) + " message refused: the mailbox is still full";
    finding.message = "The " + Name(e.header.protocol) + " message in frame " + std::to_string(e.frame().number) +
                      " came back with working counter 0: " + RequestText(e.outstanding) + " of frame " +
                      std::to_string(e.outstanding.frame.number) +
                      " is still in the mailbox. Wait for the answer, or look at 0x0805, before the next message.";
    finding.evidence.push_back(Number("working_counter", 0));
    finding.evidence.push_back(Text("outstanding", RequestText(e.outstanding)));
    finding.evidence.push_back(Number("counter", e.header.counter));
    AddRelated(finding, e.outstanding.frame.number);
    const FindingIndex index = Report(key, std::move(finding));
    if (index != kNoFinding) outstanding_.emplace(index, e.outstanding.frame.number);
  }

  void Finish() override {
    if (SaidNothingReturned()) return;
    for (const auto& [index, request] : outstanding_) {
      Finding& finding = context().store[index];
      finding.caused_by = context().ExplanationOf(finding.slave, request);
    }
  }

 private:
  std::map<FindingIndex, FrameNo> outstanding_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxOverrun>};

}  // namespace
}  // namespace ecaudit::mailbox_overrun
