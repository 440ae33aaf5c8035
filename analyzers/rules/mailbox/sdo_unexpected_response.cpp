#include <utility>
#include <vector>

#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::sdo_unexpected_response {
namespace {

constexpr FindingKind kNoRequest{
    .name = "no-request",
    .title = "SDO response for [{object}][{!object}a segment] without a request",
    .message =
        R"(The SDO response for [{object}][{!object}a segment] in {frame} (command {command}) belongs to no request: no
SDO request is outstanding.[ It is an abort with {abort_code}.])",
    .next = "Check that the master compares index and subindex, and its time-out.",
    .identity = "object"};

constexpr FindingKind kWrongCommand{
    .name = "wrong-command",
    .title = "SDO response with command {command} to the request for {expected_object}",
    .message =
        R"(The SDO response for [{object}][{!object}a segment] in {frame} has command {command}. This command does not
answer the outstanding request for {expected_object}[ in {request_frame}].[ The response is an abort with
{abort_code}.])",
    .next = "Check that the master compares index and subindex, and its time-out.",
    .identity = "object expected_object"};

constexpr FindingKind kWrongObject{
    .name = "wrong-object",
    .title = "SDO response for [{object}][{!object}a segment] instead of {expected_object}",
    .message = R"(The SDO response in {frame} (command {command}) is for [{object}][{!object}a segment]. The outstanding
request[ in {request_frame}] is for {expected_object}.[ The response is an abort with {abort_code}.])",
    .next = "Check that the master compares index and subindex, and its time-out.",
    .identity = "object expected_object"};

constexpr FindingKind kOneLate{
    .name = "one-late",
    .title = "SDO responses one request late: master took an {between} message for one",
    .message =
        R"(The master requests {object} in {given_up_frame} and reads an {between} message in {between_frame}. It does
not read the mailbox again before the next request, {request_frame} for {expected_object}. The response for {object} then
comes in {frame}. From there on each response belongs to the request before.)",
    .next =
        R"(Let the master read the mailbox until the SDO response is there, and handle {between} messages apart: a slave
may send them at any time.)",
    .identity = "between"};

constexpr NoteKind kLate{
    .name = "late",
    .text = "It is probably the late response to the request in {given_up_frame}, which the master gave up."};

constexpr const FindingKind* kKinds[] = {&kNoRequest, &kWrongCommand, &kWrongObject, &kOneLate};
constexpr const NoteKind* kNotes[] = {&kLate};

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"sdo-incomplete"};

constexpr RuleInfo kInfo{.id = "sdo-unexpected-response",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .subject = Subject::kCoe,
                         .title = "An SDO response does not match the outstanding request",
                         .needs = "the request before the response",
                         .source = "ETG1000.6, SDO services",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether each SDO response belongs to the outstanding request: its command answers the request, and index and subindex
are the same.

## Why it matters
A master that does not compare them uses the value of another object. Other masters wait until their time-out.

## How it is decided
- An abort may have index and subindex 0. A response to complete access may have another subindex.
- A response without an outstanding request counts only if the capture has an earlier request: the first response of a
  capture may belong to a request before the capture.
- If the frame of a request was lost, the response may belong to that request: no finding.
- The master read a message of another protocol (EoE) after a request, and sent the next request without reading on: one
  finding for all responses that come one request late.
- A response for an object whose request the master gave up is named as late. If mailbox-no-response reported that
  request, caused_by names it.

## Example
The response for 6040h:0 to a request for 6041h:0.

## What to do
Check the request before: if the time-out is too short, each response comes one request late.
)"};

class SdoUnexpectedResponse final : public Rule {
 public:
  SdoUnexpectedResponse() : Rule(kInfo) {
    Subscribe<mailbox::SdoUnexpected>(&SdoUnexpectedResponse::On);
    Subscribe<mailbox::MailboxUnanswered>(&SdoUnexpectedResponse::On);
    Subscribe<mailbox::MailboxMessage>(&SdoUnexpectedResponse::On);
  }

  /// A request whose frame never returned becomes known after its answer.
  void On(const mailbox::MailboxMessage& m) {
    const bool lost = m.certainty == Certainty::kUnknown;
    if (lost && m.direction == mailbox::Direction::kOut) deferred_.Lost(m.slave, m.frame().number);
    if (m.direction == mailbox::Direction::kIn && IsOfAnotherProtocol(m)) {
      if (m.slave >= other_.size()) other_.resize(static_cast<std::size_t>(m.slave) + 1);
      other_[m.slave] = {m.header.protocol, m.frame()};
    }
    if (m.slave >= last_message_.size()) last_message_.resize(static_cast<std::size_t>(m.slave) + 1);
    last_message_[m.slave].Take(m.frame().number);
  }

  void On(const mailbox::MailboxUnanswered& e) {
    if (e.request.protocol != mailbox::Protocol::kCoE || !e.request.index) return;
    if (e.slave >= given_up_.size()) given_up_.resize(static_cast<std::size_t>(e.slave) + 1);
    given_up_[e.slave] = e.request;
  }

  void On(const mailbox::SdoUnexpected& e) {
    // Without a request in the capture, the capture may miss it since the message before.
    const FrameNo since = e.request.seen() ? e.request.number : MessageBefore(e.slave, e.response.number);
    if (context().network().MayMissBetween(since, e.response.number)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, e.response.number);
      return;
    }
    if (IsOneLate(e)) return;
    const std::uint64_t key = static_cast<std::uint64_t>(e.reason) | static_cast<std::uint64_t>(e.index) << 8U |
                              static_cast<std::uint64_t>(e.subindex) << 24U |
                              static_cast<std::uint64_t>(e.expected_index) << 32U |
                              static_cast<std::uint64_t>(e.expected_subindex) << 48U;
    Finding finding = Found(KindOf(e.reason), e.slave, e.response);
    finding.Set("command", arg::Hex(e.command, 2));
    if (e.has_object) {
      finding.Set("object", arg::Object(e.index, e.subindex))
          .Set("index", arg::Hex(e.index))
          .Set("subindex", arg::Number(e.subindex));
    }
    if (e.request.seen()) {
      finding.Set("expected_index", arg::Hex(e.expected_index))
          .Set("expected_subindex", arg::Number(e.expected_subindex))
          .Set("request_frame", arg::Frame(e.request.number));
    }
    if (e.reason != mailbox::SdoUnexpected::Reason::kNoRequest) {
      finding.Set("expected_object", arg::Object(e.expected_index, e.expected_subindex));
    }
    if (e.abort) finding.Set("abort_code", arg::Code(e.abort_code, mailbox::AbortCodeText(e.abort_code), 8));
    if (const mailbox::RequestSummary* late = GivenUp(e); late != nullptr) {
      finding.Add(kLate, {{"given_up_frame", arg::Frame(late->frame.number)}});
      finding.caused_by = context().ExplanationOf(e.slave, late->frame.number);
      AddRelated(finding, late->frame.number);
    }
    AddRelated(finding, e.request.number);
    deferred_.Add({e.request.number, key, std::move(finding)});
    deferred_.SettleOld([this](DeferredFinding&& d) { Settle(std::move(d)); });
  }

  void Finish() override {
    deferred_.SettleAll([this](DeferredFinding&& d) { Settle(std::move(d)); });
    (void)NotEvaluableWithoutReturns();
  }

 private:
  static constexpr std::uint64_t kOneLateKey = std::uint64_t{1} << 63U;

  static const FindingKind& KindOf(mailbox::SdoUnexpected::Reason reason) {
    switch (reason) {
      case mailbox::SdoUnexpected::Reason::kNoRequest:
        break;
      case mailbox::SdoUnexpected::Reason::kWrongCommand:
        return kWrongCommand;
      case mailbox::SdoUnexpected::Reason::kWrongObject:
        return kWrongObject;
    }
    return kNoRequest;
  }

  void Settle(DeferredFinding&& d) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(d.finding.slave, ReasonCode::kMissesPackets, d.finding.first.number);
      return;
    }
    if (Repeat(d.finding.slave, d.key, d.finding.first) == kNoFinding) Report(d.key, std::move(d.finding));
  }

  /// Reports, or counts, a response that comes one request late because the master took another message for one.
  bool IsOneLate(const mailbox::SdoUnexpected& e) {
    const mailbox::RequestSummary* late = GivenUp(e);
    if (late == nullptr || !e.request.seen()) return false;
    if (e.slave >= one_late_.size()) one_late_.resize(static_cast<std::size_t>(e.slave) + 1);
    const FrameNo request_of_last = std::exchange(one_late_[e.slave], 0);
    const OtherMessage* other = ReadInstead(e, *late);
    if (other == nullptr && (request_of_last == 0 || late->frame.number != request_of_last)) return false;
    one_late_[e.slave] = e.request.number;
    Finding finding = Found(kOneLate, e.slave, e.response);
    finding.Set("object", arg::Object(e.index, e.subindex))
        .Set("expected_object", arg::Object(e.expected_index, e.expected_subindex))
        .Set("given_up_frame", arg::Frame(late->frame.number))
        .Set("request_frame", arg::Frame(e.request.number));
    if (other != nullptr) {
      finding.Set("between", ProtocolValue(other->protocol)).Set("between_frame", arg::Frame(other->frame.number));
      AddRelated(finding, other->frame.number);
    }
    AddRelated(finding, late->frame.number);
    AddRelated(finding, e.request.number);
    deferred_.Add({e.request.number, kOneLateKey, std::move(finding)});
    deferred_.SettleOld([this](DeferredFinding&& d) { Settle(std::move(d)); });
    return true;
  }

  [[nodiscard]] const mailbox::RequestSummary* GivenUp(const mailbox::SdoUnexpected& e) const {
    if (e.slave >= given_up_.size() || !e.has_object) return nullptr;
    const mailbox::RequestSummary& last = given_up_[e.slave];
    return last.index == e.index && last.subindex == e.subindex ? &last : nullptr;
  }

  /// A message from the slave that answers no mailbox request of CoE.
  struct OtherMessage {
    mailbox::Protocol protocol = mailbox::Protocol::kError;
    FrameRef frame;
  };

  static bool IsOfAnotherProtocol(const mailbox::MailboxMessage& m) {
    return m.problem == mailbox::Problem::kNone && m.header.protocol != mailbox::Protocol::kCoE &&
           m.header.protocol != mailbox::Protocol::kError;
  }

  /// What the master read after the request that it gave up, and before the next one.
  [[nodiscard]] const OtherMessage* ReadInstead(const mailbox::SdoUnexpected& e,
                                                const mailbox::RequestSummary& late) const {
    if (e.slave >= other_.size() || !e.request.seen()) return nullptr;
    const FrameNo frame = other_[e.slave].frame.number;
    return late.frame.number < frame && frame < e.request.number ? &other_[e.slave] : nullptr;
  }

  /// Frames of the last two messages of a slave.
  struct LastMessages {
    FrameNo last = 0;
    FrameNo before = 0;

    void Take(FrameNo frame) {
      if (frame != last) before = std::exchange(last, frame);
    }
  };

  /// 0: none.
  [[nodiscard]] FrameNo MessageBefore(SlaveId slave, FrameNo response) const {
    if (slave >= last_message_.size()) return 0;
    const LastMessages& messages = last_message_[slave];
    return messages.last < response ? messages.last : messages.before;
  }

  std::vector<mailbox::RequestSummary> given_up_;  // the last one of each slave
  std::vector<LastMessages> last_message_;         // likewise
  std::vector<OtherMessage> other_;                // likewise
  std::vector<FrameNo> one_late_;                  // of each slave: the request before which such a response came
  DeferredFindings deferred_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoUnexpectedResponse>};

}  // namespace
}  // namespace ecaudit::sdo_unexpected_response
