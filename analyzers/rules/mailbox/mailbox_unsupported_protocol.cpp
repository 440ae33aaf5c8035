#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/esc/sii.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"
#include "decoder/track/network.h"

namespace ecaudit::mailbox_unsupported_protocol {
namespace {

constexpr FindingKind kRejectedKind{
    .name = "rejected",
    .title = "{protocol} request, but the slave [supports {listed} only][{!listed}does not support it]",
    .message = R"(The master sends a mailbox request ({protocol}) in {frame}. The [EEPROM of the slave (word 0x1C) lists
{listed} only][{!listed}manual of the slave calls this type reserved ({source})]. The slave rejected the request with a
mailbox error in {answer_frame}.)",
    .next = "Switch the protocol off for this slave in the master.",
    .identity = "protocol"};

constexpr FindingKind kUnansweredKind{
    .name = "unanswered",
    .title = "{protocol} request, but the slave [supports {listed} only][{!listed}does not support it]",
    .message = R"(The master sends a mailbox request ({protocol}) in {frame}. The [EEPROM of the slave (word 0x1C) lists
{listed} only][{!listed}manual of the slave calls this type reserved ({source})]. The slave had not answered [at the
last poll, in {last_poll_frame}][{!last_poll_frame}when the wait ended].)",
    .next = "Switch the protocol off for this slave in the master.",
    .identity = "protocol"};

constexpr FindingKind kAnsweredKind{
    .name = "answered",
    .title = "{protocol} is answered, but [the EEPROM lists {listed} only][{!listed}the manual calls it reserved]",
    .message = R"(The master sends a mailbox request ({protocol}) in {frame}. The [EEPROM of the slave (word 0x1C) lists
{listed} only][{!listed}manual of the slave calls this type reserved ({source})]. The slave answered it in
{answer_frame}.)",
    .next = "",
    .identity = "protocol"};

constexpr const FindingKind* kKinds[] = {&kRejectedKind, &kUnansweredKind, &kAnsweredKind};

constexpr Word kEeprom{"eeprom", "the EEPROM"};
constexpr Word kManual{"manual", "the manual"};
constexpr Word kProtocols{"mailbox-protocols", "the list of mailbox protocols in the EEPROM (word 0x1C)"};

// They are its consequences.
constexpr std::string_view kAfter[] = {"mailbox-error-reply", "mailbox-no-response"};

constexpr RuleInfo kInfo{.id = "mailbox-unsupported-protocol",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .title = "A mailbox protocol is used that the slave does not support",
                         .needs = "the EEPROM word 0x1C of the slave, or the list of protocols in its family's manual",
                         .source = "ETG2010, mailbox protocols; AKD-2011, 4.12.1; MKD, 4.13.1; PILZ, 4.10.1",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Requests of a protocol (AoE, EoE, CoE, FoE, SoE, VoE) that the slave's EEPROM does not list or that its family's manual
calls reserved.

## Why it matters
The slave rejects the request or does not answer. Many masters wait until their time-out.

## How it is decided
Word 0x1C of the EEPROM (mailbox protocols) decides if the master read it and it is not empty. Otherwise the list in the
manual decides. A protocol that this list does not mention is not evaluated.

- Rejected by a mailbox error, or not answered: a warning, and caused_by of that finding names this one.
- Answered: an info. The slave supports more than its documents list.

## Example
samples/captures/foe-unsupported.pcapng: an FoE request to a drive whose EEPROM lists CoE only.

## What to do
Switch the protocol off in the master's configuration of this slave (TwinCAT sends requests for EoE settings if EoE is
selected), or use the ESI file of its firmware.
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
    if (m.slave >= requested_.size()) requested_.resize(static_cast<std::size_t>(m.slave) + 1);
    FrameRef& requested = requested_[m.slave][protocol];
    if (m.direction == mailbox::Direction::kOut) {
      if (!requested.seen()) requested = m.frame();
      AddWhereUnknown(m);
      return;
    }
    if (!requested.seen()) return;
    const FrameRef request = requested;
    const std::optional<Lack> why = Unsupported(m.slave, m.header.protocol);
    if (!why) return;
    if (Repeat(m.slave, Key(m.header.protocol, Outcome::kAnswered), request) != kNoFinding) return;
    Finding finding = Describe(kAnsweredKind, m.slave, m.header.protocol, request, *why);
    finding.Set("answer_frame", arg::Frame(m.frame().number));
    AddRelated(finding, m.frame().number);
    Report(Key(m.header.protocol, Outcome::kAnswered), Severity::kInfo, std::move(finding));
  }

  void On(const mailbox::MailboxErrorReply& e) {
    if (!e.request.frame.seen()) return;
    const FindingIndex index = Evaluate(e.slave, e.request, Outcome::kRejected, e.frame);
    ExplainFindings(context(), "mailbox-error-reply", e.slave, e.frame.number, index);
  }

  void On(const mailbox::MailboxUnanswered& e) {
    if (EvaluateWait(context(), e) != WaitVerdict::kUnanswered) return;
    // A lost read, or a mailbox that the slave does not serve at all, has nothing to do with the protocol.
    if (e.read_lost || e.not_accepted) return;
    const FindingIndex index = Evaluate(e.slave, e.request, Outcome::kUnanswered, e.last_poll);
    ExplainFindings(context(), "mailbox-no-response", e.slave, e.request.frame.number, index);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  enum class Outcome : std::uint8_t { kRejected, kUnanswered, kAnswered };

  /// Where the protocol is missing.
  struct Lack {
    const Word* by = nullptr;
    std::string text;  ///< kEeprom: the protocols listed; kManual: the section
    Reference reference;
  };

  static std::uint64_t Key(mailbox::Protocol protocol, Outcome outcome) {
    return static_cast<std::uint64_t>(protocol) | static_cast<std::uint64_t>(outcome) << 8U;
  }

  FindingIndex Evaluate(SlaveId slave, const mailbox::RequestSummary& request, Outcome outcome,
                        const FrameRef& shown_by) {
    const std::optional<Lack> why = Unsupported(slave, request.protocol);
    if (!why) return kNoFinding;
    const std::uint64_t key = Key(request.protocol, outcome);
    if (const FindingIndex known = Repeat(slave, key, request.frame); known != kNoFinding) return known;
    Finding finding = Describe(outcome == Outcome::kRejected ? kRejectedKind : kUnansweredKind, slave, request.protocol,
                               request.frame, *why);
    if (shown_by.seen()) {
      finding.Set(outcome == Outcome::kRejected ? "answer_frame" : "last_poll_frame", arg::Frame(shown_by.number));
    }
    AddRelated(finding, shown_by.number);
    return Report(key, std::move(finding));
  }

  static Finding Describe(const FindingKind& kind, SlaveId slave, mailbox::Protocol protocol, const FrameRef& request,
                          const Lack& why) {
    Finding finding = Found(kind, slave, request);
    finding.reference = why.reference;
    finding.Set("protocol", ProtocolValue(protocol))
        .Set("because", arg::Of(*why.by))
        .Set(why.by == &kEeprom ? "listed" : "source", arg::Text(why.text));
    return finding;
  }

  /// Why the slave does not support the protocol; nothing if it does, or if neither EEPROM nor manual lists it.
  [[nodiscard]] std::optional<Lack> Unsupported(SlaveId slave, mailbox::Protocol protocol) const {
    const std::uint16_t bit = SiiProtocolOf(protocol);
    if (const std::optional<std::uint16_t> word = EepromWord(slave)) {
      if (bit == 0 || (*word & bit) != 0) return std::nullopt;
      return Lack{&kEeprom, esc::SiiProtocolNames(*word), ReferenceTo("ETG2010, mailbox protocols")};
    }
    const device::DeviceDescription& family = *context().slave(slave).profile;
    const device::MailboxProtocol* entry = family.mailbox.FindProtocol(static_cast<std::uint8_t>(protocol));
    if (entry == nullptr || !entry->reserved) return std::nullopt;
    return Lack{&kManual, entry->source, ReferenceTo(entry->source)};
  }

  [[nodiscard]] std::optional<std::uint16_t> EepromWord(SlaveId slave) const {
    constexpr std::uint32_t kProtocolsWord = 0x1C;
    const std::optional<std::uint16_t> word = context().network().state(slave).sii.image().Word(kProtocolsWord);
    return word == 0 || word == 0xFFFF ? std::nullopt : word;  // an empty EEPROM
  }

  void AddWhereUnknown(const mailbox::MailboxMessage& m) {
    if (EepromWord(m.slave)) return;
    const device::DeviceDescription& family = *context().slave(m.slave).profile;
    const auto& protocols = family.mailbox.protocols;
    const bool listed =
        std::any_of(protocols.begin(), protocols.end(), [](const device::MailboxProtocol& p) { return p.reserved; });
    if (listed) return;
    NotEvaluable(m.slave, ReasonCode::kNotInCapture, kProtocols, m.frame().number);
  }

  std::vector<std::array<FrameRef, 16>> requested_;  // first request of each protocol
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxUnsupportedProtocol>};

}  // namespace
}  // namespace ecaudit::mailbox_unsupported_protocol
