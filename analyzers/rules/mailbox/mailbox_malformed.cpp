#include <optional>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/network.h"

namespace ecaudit::mailbox_malformed {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-malformed",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "A mailbox message is malformed: its lengths or fields do not fit",
                         .needs = "the settings of sync managers 0 and 1",
                         .source = "ETG1000.4, mailbox; ETG1000.6, CoE",
                         .doc = R"(
## What it checks
Each message through a mailbox: the length in its header against the mailbox and the bytes transferred, the reserved
bit, the type, and whether the protocol's own header and fixed fields fit into the length and have defined values.

## Why it matters
The receiver drops such a message or answers with a mailbox error. A message whose last byte was never written stays
invisible to the slave: the sync manager hands the mailbox over only when its last byte is accessed.

## How it is decided
From the bytes of the message as they were written or read. Bytes cut by the snap length are not judged. Bits that
the vendor manuals call reserved but the standard defines (the counter) are not judged. Where the settings of the
mailbox sync managers are not in the capture, messages are recognised by their contents, so that malformed ones are not
found and the rule says so.

## Example
A request with length 0, or one of 10 bytes whose SDO part ends behind the command.

## What to do
From the master: look at the code that builds the message; the length counts the bytes behind the six header bytes.
From the slave: its mailbox code; note the frame and ask the vendor.
)"};

class MailboxMalformed final : public Rule {
 public:
  MailboxMalformed() : Rule(kInfo) {
    Subscribe<mailbox::MailboxMessage>(&MailboxMalformed::On);
    Subscribe<mailbox::SdoInfo>(&MailboxMalformed::On);
  }

  void On(const mailbox::MailboxMessage& m) {
    if (m.window_inferred) {
      NotEvaluable(m.slave, "sync managers 0 and 1 were set before the capture: malformed messages are not recognised",
                   m.frame().number);
    }
    if (m.problem == mailbox::Problem::kNone || m.repeated) return;
    const std::uint64_t key = static_cast<std::uint64_t>(m.problem) | static_cast<std::uint64_t>(m.direction) << 8U |
                              static_cast<std::uint64_t>(m.header.protocol) << 16U;
    if (Repeat(m.slave, key, m.frame()) != kNoFinding) return;
    Finding finding;
    finding.slave = m.slave;
    finding.first = m.frame();
    finding.confidence = m.window_inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = "Malformed mailbox message " + WhichWay(m.direction);
    finding.message = "The " + Name(m.header.protocol) + " message " + WhichWay(m.direction) + " in frame " +
                      std::to_string(m.frame().number) + " is malformed: " + std::string(Describe(m.problem)) +
                      ". Its header says " + Count(m.header.length, "byte") + " of type " +
                      std::to_string(static_cast<unsigned>(m.header.protocol)) + ", counter " +
                      std::to_string(m.header.counter);
    const std::optional<std::uint16_t> mailbox_length = LengthOf(m);
    if (mailbox_length) {
      finding.message += "; the mailbox has " + Count(*mailbox_length, "byte") + ", six of them for the header";
    }
    finding.message += m.direction == mailbox::Direction::kOut
                           ? ". The slave can only drop it or answer with a mailbox error: correct the master."
                           : ". The master cannot use it: this is a fault of the slave's mailbox code.";
    finding.evidence.push_back(Text("problem", std::string(Describe(m.problem))));
    finding.evidence.push_back(Number("length", m.header.length));
    finding.evidence.push_back(Number("type", static_cast<int>(m.header.protocol)));
    if (mailbox_length) finding.evidence.push_back(Number("mailbox_length", *mailbox_length));
    AddRelated(finding, m.first.number == finding.first.number ? 0 : m.first.number);
    Report(key, std::move(finding));
  }

  void On(const mailbox::SdoInfo& info) {
    if (!info.malformed || !info.response.seen()) return;
    constexpr std::uint64_t kKey = 1ULL << 32U;
    if (Repeat(info.slave, kKey, info.response) != kNoFinding) return;
    Finding finding;
    finding.slave = info.slave;
    finding.first = info.response;
    finding.title = "Malformed SDO information answer from the slave";
    finding.message =
        "The SDO information answer in frame " + std::to_string(info.response.number) +
        " ends before its fixed fields: the length in the mailbox header is too small for what the answer "
        "has to hold.";
    if (info.abort_code != 0) {
      finding.message += " Behind the end of the message stands " + Hex(info.abort_code, 8) +
                         ", a defined abort code: the slave counts its error answer too short.";
    }
    finding.message += " This is a fault of the slave's mailbox code; masters that trust the length see no reason.";
    finding.evidence.push_back(Text("problem", "fixed fields are missing from the SDO information answer"));
    AddRelated(finding, info.request.number);
    Report(kKey, std::move(finding));
  }

 private:
  [[nodiscard]] std::optional<std::uint16_t> LengthOf(const mailbox::MailboxMessage& m) const {
    const std::size_t number = m.direction == mailbox::Direction::kOut ? 0 : 1;
    const auto sm = context().network().state(m.slave).sync_manager(number, Certainty::kInferred);
    if (m.window_inferred || !sm || !sm->mailbox()) return std::nullopt;
    return sm->length;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxMalformed>};

}  // namespace
}  // namespace ecaudit::mailbox_malformed
