#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/bytes.h"
#include "decoder/base/time.h"
#include "decoder/esc/sii.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/access.h"
#include "decoder/track/network.h"

namespace ecaudit::mailbox_error_reply {
namespace {

constexpr FindingKind kErrorReply{.name = "error-reply",
                                  .title = "[{protocol} rejected: error][{!protocol}Mailbox error] {detail}",
                                  .message = R"(The slave answers [the [SDO request for {object}][{!object}{protocol}
request] in {request_frame}][{!request_frame}a message that is not in the capture] with mailbox error
{detail}.[{?undefined} The standard does not define this code.] The request had no effect.[ The reply has type {type},
the standard has 0x0001.])",
                                  .next =
                                      "{advice}.[{?polls_on} Correct the master: it must accept the error reply as "
                                      "the answer.]",
                                  .identity = "detail protocol object"};

constexpr FindingKind kRejected{
    .name = "protocol-rejected",
    .title = "{protocol} rejected, although the EEPROM lists it (mailbox error {detail:number})",
    .message =
        R"(The slave answers [the SDO request for {object}][{!object}the {protocol} request] in
{request_frame} with mailbox error {detail}. Word 0x001C of its EEPROM lists {listed}. So the firmware of the slave does not
handle a protocol that its EEPROM offers.)",
    .next =
        R"(Enable {protocol} in the firmware of the slave, or write the EEPROM image that
belongs to this firmware.)",
    .identity = "detail protocol"};

constexpr NoteKind kTransferOpen{
    .name = "transfer-open",
    .text =
        R"(The transfer that began in {transfer_frame} was neither finished nor aborted before. The slave probably still
keeps it open.)"};

constexpr NoteKind kPollsOn{
    .name = "polls-on",
    .text =
        R"(After the error reply the master does nothing but read the status of the in mailbox (0x080D): {polls} over
{polled_ms}, the last in {last_poll_frame}. The mailbox is empty. So the master waits for another answer, which the slave does
not send.)"};

constexpr const FindingKind* kKinds[] = {&kErrorReply, &kRejected};
constexpr const NoteKind* kNotes[] = {&kTransferOpen, &kPollsOn};

constexpr Word kNotSupported{
    "not-supported", "Do not send it to this slave: see its EEPROM (word 0x1C) and manual for what it supports"};
constexpr Word kBusy{"finish-before", "Finish or abort the earlier request first: the slave is busy with it"};
constexpr Word kCheckHeader{"check-header", "Check the header and the length of the request"};

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"sdo-incomplete"};

constexpr RuleInfo kInfo{.id = "mailbox-error-reply",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "The slave answers a request with a mailbox error",
                         .needs = "the messages in the mailbox of the slave",
                         .source = "ETG1000.4, mailbox error service",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Messages of type 0 from the slave: the slave cannot use a message of the master. The detail is the reason:

- 1: header syntax
- 2: protocol not supported
- 3: channel
- 4: service not supported
- 5: header invalid
- 6: too short
- 7: no memory
- 8: inconsistent length
- 9: service already in work

## Why it matters
Many masters do not accept it as the answer and wait until their time-out. The request had no effect.

## How it is decided
The reply names no request. It belongs to the outstanding request with the same counter, else to the latest one without
an answer.

- If the slave does not support the protocol of that request, caused_by names mailbox-unsupported-protocol.
- If the slave rejects a protocol that its EEPROM lists (word 0x001C), that is one finding for the protocol.
- If the master reads 0x080D and sends nothing else for at least 500 ms after the reply, a note states that it waits for
  another answer.
- If the slave is busy or has no memory (7, 9) after a segmented transfer that was left unfinished, caused_by names
  sdo-incomplete.

## Example
samples/captures/foe-unsupported.pcapng: an FoE request to a drive without FoE, answered with detail 2.

## What to do
Check the detail and the request that it answers. For 7 and 9 finish or abort the earlier transfer first.
)"};

constexpr EscAddress kInMailboxStatus = 0x080D;
constexpr std::uint16_t kServiceNotSupported = 4;
constexpr std::uint16_t kNoMemory = 7;
constexpr std::uint16_t kInWork = 9;

class MailboxErrorReplyRule final : public Rule {
 public:
  MailboxErrorReplyRule() : Rule(kInfo) {
    Subscribe<mailbox::MailboxErrorReply>(&MailboxErrorReplyRule::On);
    Subscribe<mailbox::SdoTransfer>(&MailboxErrorReplyRule::On);
    Subscribe<mailbox::MailboxMessage>(&MailboxErrorReplyRule::On);
    Subscribe<track::SlaveAccess>(&MailboxErrorReplyRule::On, MemoryRange::Of(kInMailboxStatus, 1));
  }

  void On(const mailbox::MailboxMessage& e) { EndPolls(e.slave); }

  void On(const track::SlaveAccess& e) {
    const auto found = polls_.find(e.slave);
    if (found == polls_.end() || e.broadcast) return;
    const ByteSpan status = e.Covered(e.read, kInMailboxStatus, 1);
    constexpr std::uint8_t kFull = 0x08;
    if (status.empty() || (LittleEndian<std::uint8_t>(status, 0) & kFull) != 0) return;
    ++found->second.count;
    found->second.copies += (e.sent.seen() ? 1U : 0U) + (e.returned.seen() ? 1U : 0U);
    found->second.last = e.frame();
  }

  void On(const mailbox::MailboxErrorReply& e) {
    const std::uint16_t listed = ListedProtocols(e);
    const std::uint64_t key = static_cast<std::uint64_t>(e.detail) |
                              (listed != 0 ? kOfProtocol | static_cast<std::uint64_t>(e.request.protocol) << 16U
                                           : RequestKey(e.request) << 16U);
    const FindingIndex known = Repeat(e.slave, key, e.frame);
    if (known != kNoFinding) {
      AddRelated(context().store[known], e.request.frame.number);
      return;
    }
    const std::string_view text = mailbox::MailboxErrorText(e.detail);
    Finding finding = Found(listed != 0 ? kRejected : kErrorReply, e.slave, e.frame);
    if (listed != 0) finding.Set("listed", arg::Text(esc::SiiProtocolNames(listed)));
    finding.Set("detail", arg::Code(e.detail, text))
        .Set("undefined", arg::Flag(text.empty()))
        .Set("advice", arg::Of(AdviceFor(e.detail)));
    if (!text.empty()) finding.Set("meaning", arg::Text(text));
    if (e.request.frame.seen()) {
      SetRequest(finding.arguments, e.request);
      finding.Set("request_frame", arg::Frame(e.request.frame.number));
    }
    if (e.type != 1) finding.Set("type", arg::Hex(e.type));
    AddRelated(finding, e.request.frame.number);
    const FindingIndex index = Report(key, std::move(finding));
    EndPolls(e.slave);
    if (index != kNoFinding) polls_[e.slave] = {index, e.frame, e.frame, 0, 0};
    const auto left = unfinished_.find(e.slave);
    if (index != kNoFinding && left != unfinished_.end() && (e.detail == kNoMemory || e.detail == kInWork)) {
      waiting_[index] = left->second;
    }
  }

  void On(const mailbox::SdoTransfer& transfer) {
    if (transfer.outcome == mailbox::SdoOutcome::kSuperseded && transfer.answered) {
      unfinished_[transfer.slave] = transfer.request.seen() ? transfer.request.number : transfer.last.number;
    } else if (transfer.answered && transfer.outcome != mailbox::SdoOutcome::kMailboxError) {
      unfinished_.erase(transfer.slave);  // the slave accepts new transfers again
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    while (!polls_.empty()) EndPolls(polls_.begin()->first);
    std::vector<Finding>& findings = context().store.findings();
    for (const auto& [index, request] : waiting_) {
      if (findings[index].caused_by != kNoFinding) continue;
      findings[index].caused_by = context().ExplanationOf(findings[index].slave, request);
      if (findings[index].caused_by == kNoFinding) continue;
      findings[index].Add(kTransferOpen, {{"transfer_frame", arg::Frame(request)}});
    }
  }

 private:
  static constexpr std::uint64_t kOfProtocol = std::uint64_t{1} << 63U;

  /// Reads of the status of the in mailbox since an error reply.
  struct Polls {
    FindingIndex finding = kNoFinding;
    FrameRef reply, last;
    std::uint64_t count = 0;
    std::uint64_t copies = 0;  ///< of their frames in the capture
  };

  /// They are what the master does if hardly any other frame lies between.
  void EndPolls(SlaveId slave) {
    constexpr TimeNs kLong = 500'000'000;
    const auto found = polls_.find(slave);
    if (found == polls_.end()) return;
    const Polls polls = found->second;
    polls_.erase(found);
    if (!polls.reply.has_time || !polls.last.has_time) return;
    const TimeNs took = Elapsed(polls.reply.time, polls.last.time);
    const std::uint64_t frames = polls.last.number - polls.reply.number;
    if (took < kLong || polls.copies * 10 < frames * 9) return;
    Finding& finding = context().store[polls.finding];
    if (finding.Has(kPollsOn)) return;
    finding.Set("polls_on", arg::Flag());
    finding.Add(kPollsOn, {{"polls", arg::Count(polls.count, "read")},
                           {"polled_ms", arg::Ms(took)},
                           {"last_poll_frame", arg::Frame(polls.last.number)}});
  }

  /// The protocols of the EEPROM, if the slave rejects one of them; else 0.
  [[nodiscard]] std::uint16_t ListedProtocols(const mailbox::MailboxErrorReply& e) const {
    constexpr std::uint32_t kProtocolsWord = 0x1C;
    if (e.detail != mailbox::kUnsupportedProtocol || !e.request.frame.seen()) return 0;
    const std::uint16_t listed = context().network().state(e.slave).sii.image().Word(kProtocolsWord).value_or(0);
    return listed != 0xFFFF && (listed & SiiProtocolOf(e.request.protocol)) != 0 ? listed : 0;
  }

  static const Word& AdviceFor(std::uint16_t detail) {
    switch (detail) {
      case mailbox::kUnsupportedProtocol:
      case kServiceNotSupported:
        return kNotSupported;
      case kNoMemory:
      case kInWork:
        return kBusy;
      default:
        return kCheckHeader;
    }
  }

  std::map<SlaveId, Polls> polls_;
  std::map<SlaveId, FrameNo> unfinished_;    // request of the transfer that the master left open last
  std::map<FindingIndex, FrameNo> waiting_;  // findings that such a transfer may explain
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxErrorReplyRule>};

}  // namespace
}  // namespace ecaudit::mailbox_error_reply
