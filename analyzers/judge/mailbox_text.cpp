#include "analyzers/judge/mailbox_text.h"

#include <algorithm>
#include <iterator>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/esc/sii.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit {

Value ProtocolValue(mailbox::Protocol protocol) {
  static constexpr Word kWords[] = {
      {"error", "error"},     {"AoE", "AoE"},         {"EoE", "EoE"},         {"CoE", "CoE"},
      {"FoE", "FoE"},         {"SoE", "SoE"},         {"type 6", "type 6"},   {"type 7", "type 7"},
      {"type 8", "type 8"},   {"type 9", "type 9"},   {"type 10", "type 10"}, {"type 11", "type 11"},
      {"type 12", "type 12"}, {"type 13", "type 13"}, {"type 14", "type 14"}, {"VoE", "VoE"}};
  return arg::Of(kWords[static_cast<std::size_t>(protocol) % std::size(kWords)]);
}

Value DirectionValue(mailbox::Direction direction) {
  static constexpr Word kOut{"out", "from the master"}, kIn{"in", "from the slave"};
  return arg::Of(direction == mailbox::Direction::kOut ? kOut : kIn);
}

Value SenderValue(mailbox::Direction direction) {
  static constexpr Word kMaster{"master", "the master"}, kSlave{"slave", "the slave"};
  return arg::Of(direction == mailbox::Direction::kOut ? kMaster : kSlave);
}

Value ServiceValue(mailbox::SdoService service) {
  static constexpr Word kTransfer{"transfer", "transfer"}, kDownload{"download", "download"},
      kUpload{"upload", "upload"};
  switch (service) {
    case mailbox::SdoService::kUnknown:
      break;
    case mailbox::SdoService::kDownload:
      return arg::Of(kDownload);
    case mailbox::SdoService::kUpload:
      return arg::Of(kUpload);
  }
  return arg::Of(kTransfer);
}

Value OutcomeValue(mailbox::SdoOutcome outcome) {
  // The codes are those of the event stream.
  static constexpr Word kWords[] = {
      {"completed", "the transfer completed"},
      {"aborted", "the transfer was aborted"},
      {"mailbox error", "the slave returned a mailbox error"},
      {"superseded", "the master began another transfer"},
      {"unfinished at the end of the capture", "nothing followed until the end of the capture"},
      {"unfinished when the mailbox was reset", "the mailbox was reset"},
      {"answer not captured", "the answer is not in the capture"},
      {"frames missing from the capture", "frames are missing from the capture"}};
  return arg::Of(kWords[static_cast<std::size_t>(outcome) % std::size(kWords)]);
}

std::uint16_t SiiProtocolOf(mailbox::Protocol protocol) {
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

void SetRequest(Arguments& arguments, const mailbox::RequestSummary& request) {
  arguments.Set("protocol", ProtocolValue(request.protocol));
  if (request.protocol == mailbox::Protocol::kCoE && request.index) {
    arguments.Set("object", arg::Object(*request.index, request.subindex ? *request.subindex : -1));
  }
}

void SetObject(Finding& finding, const mailbox::SdoTransfer& transfer, const device::DeviceDescription& family) {
  if (!transfer.has_object) return;
  std::string_view name = family.object_name(transfer.index, transfer.subindex);
  if (transfer.complete_access) {
    const device::DictionaryObject* head = family.dictionary ? family.dictionary->FindIndex(transfer.index) : nullptr;
    name = head != nullptr ? std::string_view(head->name) : std::string_view();
  }
  finding.Set("object", arg::Object(transfer.index, transfer.complete_access ? -1 : transfer.subindex, name))
      .Set("index", arg::Hex(transfer.index))
      .Set("subindex", arg::Number(transfer.subindex))
      .Set("complete_access", arg::Flag(transfer.complete_access));
}

Confidence ConfidenceOf(Certainty certainty) {
  return certainty == Certainty::kObserved ? Confidence::kObserved : Confidence::kInferred;
}

std::uint64_t RequestKey(const mailbox::RequestSummary& request) {
  return static_cast<std::uint64_t>(request.protocol) | static_cast<std::uint64_t>(request.index.value_or(0)) << 8U |
         static_cast<std::uint64_t>(request.subindex.value_or(0)) << 24U;
}

std::optional<std::int64_t> WaitOf(const mailbox::MailboxUnanswered& event) {
  const FrameRef& from = event.since;
  const FrameRef& until = event.polls > 0 ? event.last_poll : event.ended;
  if (!from.has_time || !until.has_time) return std::nullopt;
  return Elapsed(from.time, until.time);
}

WaitVerdict EvaluateWait(const mailbox::MailboxUnanswered& event, const FrameRef& capture_end, std::int64_t limit_ns,
                         bool state_requested) {
  using End = mailbox::MailboxUnanswered::End;
  // The wait up to a capture gap counts.
  if (event.end == End::kGap && (event.polls == 0 || WaitOf(event).value_or(0) < limit_ns)) return WaitVerdict::kGap;
  if (event.polls == 0 && !event.read_lost) return WaitVerdict::kNeverPolled;
  const std::optional<std::int64_t> wait = WaitOf(event);
  if (!wait) return event.polls == 0 ? WaitVerdict::kTooShort : WaitVerdict::kNoTime;
  if (*wait >= limit_ns) return WaitVerdict::kUnanswered;
  // Masters have shorter time-outs of their own (SOEM 700 ms). A master gave up if it sent another request, requested
  // another state, or did not poll for longer than the limit.
  bool given_up = event.end != End::kCaptureEnd || state_requested;
  if (!given_up && capture_end.has_time && event.last_poll.has_time) {
    given_up = capture_end.time - event.last_poll.time >= limit_ns;
  }
  return given_up && *wait >= limit_ns / 2 ? WaitVerdict::kUnanswered : WaitVerdict::kTooShort;
}

WaitVerdict EvaluateWait(const RuleContext& context, const mailbox::MailboxUnanswered& event) {
  const FrameNo last_poll = std::max(event.last_poll.number, event.request.frame.number);
  return EvaluateWait(event, context.statistics().last, context.Limit("mailbox-no-response", kMailboxAnswerLimit),
                      context.slave(event.slave).al.last_request() > last_poll);
}

void ExplainFindings(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause,
                     Confidence confidence) {
  if (cause == kNoFinding) return;
  for (Finding& finding : context.store.findings()) {
    if (finding.rule == rule && finding.slave == slave && finding.last.number == frame &&
        finding.caused_by == kNoFinding) {
      finding.caused_by = cause;
      if (confidence == Confidence::kInferred) finding.confidence = confidence;
    }
  }
}

void ExplainAbort(RuleContext& context, const mailbox::SdoTransfer& transfer, FindingIndex cause) {
  if (transfer.outcome != mailbox::SdoOutcome::kAborted) return;
  const FrameRef& frame = transfer.last.seen() ? transfer.last : transfer.request;
  ExplainFindings(context, "sdo-abort", transfer.slave, frame.number, cause);
}

}  // namespace ecaudit
