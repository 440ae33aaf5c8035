#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/esc/sii.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"
#include "decoder/track/network.h"

namespace ecaudit::mailbox_unsupported_protocol {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-unsupported-protocol",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .title = "A mailbox protocol is used that the slave does not support",
                         .needs = "the EEPROM word 0x1C of the slave, or the list of protocols in its family's manual",
                         .source = "ETG2010, mailbox protocols; AKD-2011, 4.12.1; MKD, 4.13.1; PILZ, 4.10.1",
                         .doc = R"(
## What it checks
Requests of a protocol (AoE, EoE, CoE, FoE, SoE, VoE) that is missing from the slave's EEPROM or that its family's
manual calls reserved.

## Why it matters
The slave rejects the request or does not answer; many masters wait until their time-out.

## How it is decided
Word 0x1C of the EEPROM (mailbox protocols), where the master read it and it is not empty, beats the manual: the slave
itself knows best. Without it the manual's list decides; what the list does not mention is not judged. Then the outcome
counts: rejected by a mailbox error or not answered is a warning, and caused_by of that finding points here. Answered is
an info only: the slave offers more than its documents say.

## Example
samples/captures/foe-unsupported.pcapng: an FoE request to a drive whose EEPROM lists CoE only.

## What to do
Switch the protocol off in the master's configuration of this slave (TwinCAT asks for EoE settings where EoE is ticked),
or use the ESI file that belongs to its firmware.
)"};

class MailboxUnsupportedProtocol final : public Rule {
 public:
  MailboxUnsupportedProtocol() : Rule(kInfo) {
    Subscribe<mailbox::MailboxMessage>(&MailboxUnsupportedProtocol::On);
    Subscribe<mailbox::MailboxErrorReply>(&MailboxUnsupportedProtocol::On);
    Subscribe<mailbox::MailboxUnanswered>(&MailboxUnsupportedProtocol::On);
  }

  void On(const mailbox::MailboxMessage& m) {
    const auto protocol = static_cast<std::size_t>(m.header.protocol);
    if (m.problem != mailbox::Problem::kNone || m.late || protocol == 0 || !IsDefined(m.header.protocol)) return;
    if (m.slave >= asked_.size()) asked_.resize(static_cast<std::size_t>(m.slave) + 1);
    FrameRef& asked = asked_[m.slave][protocol];
    if (m.direction == mailbox::Direction::kOut) {
      if (!asked.seen()) asked = m.frame();
      SayWhereUnknown(m);
      return;
    }
    if (!asked.seen()) return;
    const FrameRef request = asked;
    const std::optional<Reason> why = Unsupported(m.slave, m.header.protocol);
    if (!why) return;
    if (Repeat(m.slave, Key(m.header.protocol, Outcome::kAnswered), request) != kNoFinding) return;
    Finding finding = Describe(m.slave, m.header.protocol, request, *why);
    finding.message += " It answered all the same (frame " + std::to_string(m.frame().number) + ").";
    AddRelated(finding, m.frame().number);
    Report(Key(m.header.protocol, Outcome::kAnswered), Severity::kInfo, std::move(finding));
  }

  void On(const mailbox::MailboxErrorReply& e) {
    if (!e.request.frame.seen()) return;
    const FindingIndex index = Judge(e.slave, e.request, Outcome::kRejected, e.frame);
    ExplainFindings(context(), "mailbox-error-reply", e.slave, e.frame.number, index);
  }

  void On(const mailbox::MailboxUnanswered& e) {
    if (JudgeWait(context(), e) != WaitVerdict::kUnanswered) return;
    // A lost read or a mailbox that is not served at all says nothing about the protocol.
    if (e.read_lost || e.not_taken) return;
    const FindingIndex index = Judge(e.slave, e.request, Outcome::kUnanswered, e.last_poll);
    ExplainFindings(context(), "mailbox-no-response", e.slave, e.request.frame.number, index);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  enum class Outcome : std::uint8_t { kRejected, kUnanswered, kAnswered };

  /// Who says so, in words for "but ...", and where.
  struct Reason {
    std::string text;
    Reference reference;
  };

  static std::uint64_t Key(mailbox::Protocol protocol, Outcome outcome) {
    return static_cast<std::uint64_t>(protocol) | static_cast<std::uint64_t>(outcome) << 8U;
  }

  FindingIndex Judge(SlaveId slave, const mailbox::RequestSummary& request, Outcome outcome, const FrameRef& shown_by) {
    const std::optional<Reason> why = Unsupported(slave, request.protocol);
    if (!why) return kNoFinding;
    const std::uint64_t key = Key(request.protocol, outcome);
    if (const FindingIndex known = Repeat(slave, key, request.frame); known != kNoFinding) return known;
    Finding finding = Describe(slave, request.protocol, request.frame, *why);
    finding.message += outcome == Outcome::kRejected ? " It rejected the request with a mailbox error in frame " +
                                                           std::to_string(shown_by.number) + "."
                                                     : std::string(" It did not answer.");
    finding.message += " Switch the protocol off for this slave in the master.";
    AddRelated(finding, shown_by.number);
    return Report(key, std::move(finding));
  }

  static Finding Describe(SlaveId slave, mailbox::Protocol protocol, const FrameRef& request, const Reason& why) {
    Finding finding;
    finding.slave = slave;
    finding.first = request;
    finding.title = Name(protocol) + " is not supported by this slave";
    finding.message = "The master sends " + WithArticle(protocol) + " request in frame " +
                      std::to_string(request.number) + ", but " + why.text + ".";
    finding.reference = why.reference;
    finding.evidence.push_back(Text("protocol", Name(protocol)));
    finding.evidence.push_back(Text("because", why.text));
    return finding;
  }

  /// Why the slave does not support the protocol; nothing when it does, or when nobody says.
  [[nodiscard]] std::optional<Reason> Unsupported(SlaveId slave, mailbox::Protocol protocol) const {
    const std::uint16_t bit = BitOf(protocol);
    if (const std::optional<std::uint16_t> word = EepromWord(slave)) {
      if (bit == 0 || (*word & bit) != 0) return std::nullopt;
      return Reason{"its EEPROM (word 0x1C) lists " + esc::SiiProtocolNames(*word) + " only",
                    ReferenceTo("ETG2010, mailbox protocols")};
    }
    const device::DeviceDescription& family = *context().slave(slave).profile;
    const device::MailboxProtocol* entry = family.mailbox.FindProtocol(static_cast<std::uint8_t>(protocol));
    if (entry == nullptr || !entry->reserved) return std::nullopt;
    return Reason{"its manual calls this type reserved (" + entry->source + ")", ReferenceTo(entry->source)};
  }

  [[nodiscard]] std::optional<std::uint16_t> EepromWord(SlaveId slave) const {
    constexpr std::uint32_t kProtocolsWord = 0x1C;
    const std::optional<std::uint16_t> word = context().network().state(slave).sii.image().Word(kProtocolsWord);
    return word == 0 || word == 0xFFFF ? std::nullopt : word;  // an empty EEPROM says nothing
  }

  static std::uint16_t BitOf(mailbox::Protocol protocol) {
    switch (protocol) {
      case mailbox::Protocol::kAoE:
        return esc::kSiiAoe;
      case mailbox::Protocol::kEoE:
        return esc::kSiiEoe;
      case mailbox::Protocol::kCoE:
        return esc::kSiiCoe;
      case mailbox::Protocol::kFoE:
        return esc::kSiiFoe;
      case mailbox::Protocol::kSoE:
        return esc::kSiiSoe;
      case mailbox::Protocol::kVoE:
        return esc::kSiiVoe;
      case mailbox::Protocol::kError:
        break;
    }
    return 0;
  }

  void SayWhereUnknown(const mailbox::MailboxMessage& m) {
    if (EepromWord(m.slave)) return;
    const device::DeviceDescription& family = *context().slave(m.slave).profile;
    const auto& protocols = family.mailbox.protocols;
    const bool listed =
        std::any_of(protocols.begin(), protocols.end(), [](const device::MailboxProtocol& p) { return p.reserved; });
    if (listed) return;
    NotEvaluable(m.slave, "which mailbox protocols the slave supports is not known: neither EEPROM nor manual says",
                 m.frame().number);
  }

  std::vector<std::array<FrameRef, 16>> asked_;  // first request of each protocol
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxUnsupportedProtocol>};

}  // namespace
}  // namespace ecaudit::mailbox_unsupported_protocol
