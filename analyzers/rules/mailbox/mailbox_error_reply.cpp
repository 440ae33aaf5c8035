#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::mailbox_error_reply {
namespace {

constexpr FindingKind kErrorReply{.name = "error-reply",
                                  .title = "[{protocol} rejected: error][{!protocol}Mailbox error] {detail}",
                                  .message = R"(The slave answers [the [SDO request for {object}][{!object}{protocol}
request] in {request_frame}][{!request_frame}a message that is not in the capture] with mailbox error
{detail}.[{?undefined} The standard does not define this code.] The request had no effect.[ The reply has type {type},
the standard has 0x0001.])",
                                  .next = "{advice}.",
                                  .identity = "detail protocol object"};

constexpr NoteKind kTransferOpen{
    .name = "transfer-open",
    .text =
        R"(The transfer that began in {transfer_frame} was neither finished nor aborted before. The slave probably still
keeps it open.)"};

constexpr const FindingKind* kKinds[] = {&kErrorReply};
constexpr const NoteKind* kNotes[] = {&kTransferOpen};

constexpr Word kNotSupported{
    "not-supported", "Do not send it to this slave: see its EEPROM (word 0x1C) and manual for what it supports"};
constexpr Word kBusy{"finish-before", "Finish or abort the earlier request first: the slave is busy with it"};
constexpr Word kCheckHeader{"check-header", "Check the header and the length of the request"};

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"sdo-incomplete"};

constexpr RuleInfo kInfo{.id = "mailbox-error-reply",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
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
- If the slave is busy or has no memory (7, 9) after a segmented transfer that was left unfinished, caused_by names
  sdo-incomplete.

## Example
samples/captures/foe-unsupported.pcapng: an FoE request to a drive without FoE, answered with detail 2.

## What to do
Check the detail and the request that it answers. For 7 and 9 finish or abort the earlier transfer first.
)"};

constexpr std::uint16_t kServiceNotSupported = 4;
constexpr std::uint16_t kNoMemory = 7;
constexpr std::uint16_t kInWork = 9;

class MailboxErrorReplyRule final : public Rule {
 public:
  MailboxErrorReplyRule() : Rule(kInfo) {
    Subscribe<mailbox::MailboxErrorReply>(&MailboxErrorReplyRule::On);
    Subscribe<mailbox::SdoTransfer>(&MailboxErrorReplyRule::On);
  }

  void On(const mailbox::MailboxErrorReply& e) {
    const std::uint64_t key = static_cast<std::uint64_t>(e.detail) | RequestKey(e.request) << 16U;
    const FindingIndex known = Repeat(e.slave, key, e.frame);
    if (known != kNoFinding) {
      AddRelated(context().store[known], e.request.frame.number);
      return;
    }
    const std::string_view text = mailbox::MailboxErrorText(e.detail);
    Finding finding = Found(kErrorReply, e.slave, e.frame);
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
    std::vector<Finding>& findings = context().store.findings();
    for (const auto& [index, request] : waiting_) {
      if (findings[index].caused_by != kNoFinding) continue;
      findings[index].caused_by = context().ExplanationOf(findings[index].slave, request);
      if (findings[index].caused_by == kNoFinding) continue;
      findings[index].Add(kTransferOpen, {{"transfer_frame", arg::Frame(request)}});
    }
  }

 private:
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

  std::map<SlaveId, FrameNo> unfinished_;    // request of the transfer that the master left open last
  std::map<FindingIndex, FrameNo> waiting_;  // findings that such a transfer may explain
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxErrorReplyRule>};

}  // namespace
}  // namespace ecaudit::mailbox_error_reply
