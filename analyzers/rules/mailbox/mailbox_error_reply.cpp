#include <map>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::mailbox_error_reply {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-error-reply",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "The slave answers a request with a mailbox error",
                         .needs = "what the slave put into its mailbox",
                         .source = "ETG1000.4, mailbox error service",
                         .doc = R"(
## What it checks
Messages of type 0 from the slave: it could not do anything with a message of the master. The detail says why: 1 header
syntax, 2 protocol not supported, 3 channel, 4 service not supported, 5 header invalid, 6 too short, 7 no memory,
8 inconsistent length, 9 service already in work.

## Why it matters
Many masters do not take it for the answer and wait until their time-out; whatever was requested did not happen.

## How it is decided
The reply names no request. It is taken to answer the outstanding request with the same counter, else the latest one
without an answer. Where that request's protocol is not supported at all, caused_by names mailbox-unsupported-protocol;
where the slave says that it is busy or out of memory (7, 9) and a segmented transfer was left unfinished before,
caused_by names sdo-incomplete.

## Example
samples/captures/foe-unsupported.pcapng: an FoE request to a drive without FoE, answered with detail 2.

## What to do
Look at the detail and at the request it answers. For 7 and 9 finish or abort the transfer before.
)"};

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
    const std::string text(mailbox::MailboxErrorText(e.detail));
    const bool request_known = e.request.frame.seen();
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title = "Mailbox error " + Hex(e.detail) + (text.empty() ? "" : ": " + text);
    finding.message = "The slave answers " +
                      (request_known ? RequestText(e.request) + " in frame " + std::to_string(e.request.frame.number)
                                     : std::string("a message that is not in the capture")) +
                      " with mailbox error " + Hex(e.detail) +
                      (text.empty() ? ", a code without a meaning in the standard" : " (" + text + ")") +
                      ". What was requested did not happen. " + Advice(e.detail);
    if (e.type != 1) {
      finding.message += " The reply has type " + Hex(e.type) + " where the standard has 0x0001.";
    }
    finding.evidence.push_back(HexNumber("detail", e.detail));
    if (!text.empty()) finding.evidence.push_back(Text("meaning", text));
    if (request_known) finding.evidence.push_back(Text("protocol", Name(e.request.protocol)));
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
      unfinished_.erase(transfer.slave);  // the slave takes new transfers again
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    std::vector<Finding>& findings = context().store.findings();
    for (const auto& [index, request] : waiting_) {
      if (findings[index].caused_by != kNoFinding) continue;
      findings[index].caused_by = context().ExplanationOf(findings[index].slave, request);
      if (findings[index].caused_by == kNoFinding) continue;
      findings[index].message += " The transfer begun in frame " + std::to_string(request) +
                                 " was neither finished nor aborted before: the slave probably still holds it.";
    }
  }

 private:
  static std::string Advice(std::uint16_t detail) {
    switch (detail) {
      case 2:
      case 4:
        return "Do not send it to this slave; its EEPROM (word 0x1C) and manual say what it supports.";
      case kNoMemory:
      case kInWork:
        return "The slave is busy with an earlier request: finish or abort that one first.";
      default:
        return "Check the header and the length of the request.";
    }
  }

  std::map<SlaveId, FrameNo> unfinished_;    // request of the transfer that the master left open last
  std::map<FindingIndex, FrameNo> waiting_;  // findings that such a transfer may explain
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxErrorReplyRule>};

}  // namespace
}  // namespace ecaudit::mailbox_error_reply
