#include "analyzers/judge/mailbox_text.h"

#include <algorithm>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit {

std::string WhichWay(mailbox::Direction direction) {
  return direction == mailbox::Direction::kOut ? "from the master" : "from the slave";
}

std::string WithArticle(mailbox::Protocol protocol) {
  const std::string name(Name(protocol));
  return (std::string_view("AEFS").find(name[0]) == std::string_view::npos ? "a " : "an ") + name;
}

std::string RequestText(const mailbox::RequestSummary& request) {
  if (request.protocol == mailbox::Protocol::kCoE && request.index) {
    return "the SDO request for " + ObjectName(*request.index, request.subindex ? *request.subindex : -1);
  }
  return "the " + Name(request.protocol) + " request";
}

std::string ObjectText(const mailbox::SdoTransfer& transfer, const device::DeviceDescription& family) {
  std::string out = ObjectName(transfer.index, transfer.complete_access ? -1 : transfer.subindex);
  std::string_view name = family.object_name(transfer.index, transfer.subindex);
  if (transfer.complete_access) {
    out += " (complete access)";
    const device::DictionaryObject* head = family.dictionary ? family.dictionary->FindIndex(transfer.index) : nullptr;
    name = head != nullptr ? std::string_view(head->name) : std::string_view();
  }
  if (!name.empty()) out += " " + std::string(name);
  return out;
}

Confidence ConfidenceOf(Certainty certainty) {
  return certainty == Certainty::kObserved ? Confidence::kObserved : Confidence::kInferred;
}

std::uint64_t RequestKey(const mailbox::RequestSummary& request) {
  return static_cast<std::uint64_t>(request.protocol) | static_cast<std::uint64_t>(request.index.value_or(0)) << 8U |
         static_cast<std::uint64_t>(request.subindex.value_or(0)) << 24U;
}

std::optional<std::int64_t> WaitOf(const mailbox::MailboxUnanswered& event) {
  const FrameRef& until = event.polls > 0 ? event.last_poll : event.ended;
  if (!event.request.frame.has_time || !until.has_time) return std::nullopt;
  return until.time - event.request.frame.time;
}

WaitVerdict JudgeWait(const mailbox::MailboxUnanswered& event, const FrameRef& capture_end, std::int64_t limit_ns,
                      bool state_asked) {
  using End = mailbox::MailboxUnanswered::End;
  if (event.end == End::kGap) return WaitVerdict::kGap;
  if (event.polls == 0 && !event.read_lost) return WaitVerdict::kNeverLooked;
  const std::optional<std::int64_t> wait = WaitOf(event);
  if (!wait) return event.polls == 0 ? WaitVerdict::kTooShort : WaitVerdict::kNoTime;
  if (*wait >= limit_ns) return WaitVerdict::kUnanswered;
  // Masters have shorter time-outs of their own (SOEM 700 ms). One that asks for something else, or for another state,
  // or stops looking for longer than the limit has given up.
  bool given_up = event.end != End::kCaptureEnd || state_asked;
  if (!given_up && capture_end.has_time && event.last_poll.has_time) {
    given_up = capture_end.time - event.last_poll.time >= limit_ns;
  }
  return given_up && *wait >= limit_ns / 2 ? WaitVerdict::kUnanswered : WaitVerdict::kTooShort;
}

WaitVerdict JudgeWait(const RuleContext& context, const mailbox::MailboxUnanswered& event) {
  const FrameNo last_look = std::max(event.last_poll.number, event.request.frame.number);
  return JudgeWait(event, context.statistics().last, context.Limit("mailbox-no-response", kMailboxAnswerLimit),
                   context.slave(event.slave).al.last_request() > last_look);
}

void ExplainFindings(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause) {
  if (cause == kNoFinding) return;
  for (Finding& finding : context.store.findings()) {
    if (finding.rule == rule && finding.slave == slave && finding.last.number == frame &&
        finding.caused_by == kNoFinding) {
      finding.caused_by = cause;
    }
  }
}

void ExplainAbort(RuleContext& context, const mailbox::SdoTransfer& transfer, FindingIndex cause) {
  if (transfer.outcome != mailbox::SdoOutcome::kAborted) return;
  const FrameRef& frame = transfer.last.seen() ? transfer.last : transfer.request;
  ExplainFindings(context, "sdo-abort", transfer.slave, frame.number, cause);
}

}  // namespace ecaudit
