#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/al.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/pipeline.h"

namespace ecaudit::mailbox_no_response {
namespace {

constexpr FindingKind kNoResponse{
    .name = "no-response",
    .title = "No response to the [SDO request for {object}][{!object}{protocol} request] within {waited_ms}",
    .message = R"(The master wrote the [SDO request for {object}][{!object}{protocol} request] in {frame}. [It found no
response in {polls} over {waited_ms}, the last in {last_poll_frame}.][{!last_poll_frame}It got no response within
{waited_ms}.][ Then it sent the next request in {next_request_frame}.][ Then the mailbox was reset in {reset_frame}.])",
    .next = "{advice}.",
    .identity = "protocol object"};

constexpr FindingKind kInPart{
    .name = "incomplete-response",
    .title = "Answer to the {protocol} request stops after {parts}: no more in {waited_ms}",
    .message = R"(The master wrote the {protocol} request in {frame}. The slave sent {parts} of the answer, the last in
{last_part_frame}, which announces more. [The master found no further one in {polls} over {waited_ms}, the last in
{last_poll_frame}.][{!last_poll_frame}No further one came within {waited_ms}.][ Then it sent the next request in
{next_request_frame}.][ Then the mailbox was reset in {reset_frame}.])",
    .next =
        R"(Check the firmware of the slave: it must put the next part into the mailbox when the master has read the one
before.)",
    .identity = "protocol"};

constexpr FindingKind kTooEarly{
    .name = "before-state",
    .title =
        "[SDO request for {object}][{!object}{protocol} request] written "
        "[{?unread}without waiting for {requested}][{!unread}before {requested} is reached]",
    .message =
        R"(The master requested {requested} in {state_frame} and wrote the [SDO request for {object}][{!object}{protocol}
request] in {frame}[, {after_us} later]. [{?unread}It did not read AL Status in between, so the slave may not have
reached {requested} yet.][{!unread}AL Status did not show {requested} yet.] In INIT the mailbox is not active, and a slave discards what is written before it has reached
{requested}. [The master found no response in {polls} over {waited_ms}, the last in {last_poll_frame}.][{!last_poll_frame}The
master got no response within {waited_ms}.][ Then it sent the next request in {next_request_frame}.][ Then the mailbox was
reset in {reset_frame}.])",
    .next = "Wait until AL Status (0x0130) shows {requested} before the first mailbox request.",
    .identity = "protocol object"};

constexpr FindingKind kStuck{
    .name = "out-mailbox-full",
    .title = "Out mailbox (SM0) full for {waited_ms}: the slave does not read it",
    .message = R"(The out mailbox (0x0805) was full [{?once}at the only poll, in {last_poll_frame}][{!once}at each of
{looks} from {first_poll_frame} to {last_poll_frame}]. The slave sent no message. [Nothing was written to the mailbox
from {gap_frame} on. Earlier writes are not in the capture.][{!gap_frame}The capture does not show what was written to
the mailbox.] The processor of the slave does not run, or does not serve the mailbox.)",
    .next = R"(Check whether the processor of the slave runs, and whether it serves its mailbox in this AL state.)"};

constexpr FindingKind kSlow{
    .name = "slow-response",
    .title = "Response to the [SDO request for {object}][{!object}{protocol} request] only after {waited_ms}",
    .message =
        R"(The master wrote the [SDO request for {object}][{!object}{protocol} request] in {frame}. {waited_ms} later, in
{last_poll_frame}, the mailbox was still empty. The response came in {response_frame}.[ {others} of this slave took
at most {usual_ms}.])",
    .next = R"(Give this request a longer time-out, and do not send process data in the task that waits for it.
[{?may_store}The slave may store parameters, which takes long.][{!may_store}Check what the slave does in this time.])",
    .identity = "protocol object"};

// What happened to the request.
constexpr NoteKind kStillFull{
    .name = "still-full",
    .text =
        R"(At the last poll the out mailbox (0x0805) was still full: the slave did not read the request. Its processor
does not run, or does not serve the mailbox.)"};
constexpr NoteKind kResponseLost{
    .name = "response-lost",
    .text = R"(In between, a frame that read the mailbox never returned. The response was probably lost with it.)"};
constexpr NoteKind kRequestLost{
    .name = "request-lost",
    .text = "The frame with the request never returned: the slave may not have received the request."};
constexpr NoteKind kNotKnownIfRead{
    .name = "not-known-if-read",
    .text =
        R"(The master did not read the status of the out mailbox (0x0805), so the capture does not show whether the
slave read the request. The processor of the slave does not serve the mailbox, or drops the request.)"};
constexpr NoteKind kReadCounterRight{
    .name = "read-counter-right",
    .text = "The slave read the request and does not answer it. The mailbox counter of the request is right."};
constexpr NoteKind kReadCounterEqual{
    .name = "read-counter-equal",
    .text =
        R"(The slave read the request and does not answer it. The request has the mailbox counter of the request before,
so the slave drops it as a repetition.)"};
constexpr NoteKind kRead{.name = "read", .text = "The slave read the request and does not answer it."};

// What is found out later.
constexpr NoteKind kLateResponse{
    .name = "late-response",
    .text =
        R"(The response came in {response_frame}[, {late_ms} after the request]: the slave is slower than the time-out
of the master.)"};
constexpr NoteKind kReadLost{
    .name = "read-lost",
    .text = "{lost_frame}, which read the mailbox, never returned: the response was probably lost with it."};
constexpr NoteKind kFurther{
    .name = "further-requests",
    .text =
        R"([Until {until_frame} no message came out of this mailbox.][{!until_frame}After that no message came out of
this mailbox.] {further} had no response, the last of them the [SDO request for {object}][{!object}{protocol} request]
in {last_request_frame}.)"};

constexpr const FindingKind* kKinds[] = {&kNoResponse, &kInPart, &kTooEarly, &kStuck, &kSlow};
constexpr const NoteKind* kNotes[] = {&kStillFull,        &kResponseLost,     &kRequestLost, &kNotKnownIfRead,
                                      &kReadCounterRight, &kReadCounterEqual, &kRead,        &kLateResponse,
                                      &kReadLost,         &kFurther};

constexpr Word kCheckProcessor{
    "check-processor",
    "Check whether the processor of the slave runs, and whether it serves its mailbox in this AL state"};
constexpr Word kRepeatRead{"repeat-read", "Let the master repeat the read (bit 1 of 0x080E) after a lost frame"};
constexpr Word kFindLoss{"find-loss", "Find the cause of the lost frame"};
constexpr Word kReadStatus{"read-status",
                           "Let the master read 0x0805 after the request, to see whether the slave reads it"};
constexpr Word kCheckSlave{"check-slave", "Check the slave: the request is right"};
constexpr Word kAdvanceCounter{"advance-counter",
                               "Correct the master: each new request needs the next mailbox counter"};
constexpr Word kCompareCounters{
    "compare-counters", "Compare the mailbox counter with that of the request before: if they differ, check the slave"};
constexpr Word kLongerTimeOut{"longer-time-out", "Set a longer mailbox time-out in the master"};

constexpr Word kResponse{"response", "the response to a request"};
constexpr Word kMailboxAfterRequest{"mailbox-after-request", "the mailbox after a request"};
constexpr Word kLongWait{"wait-up-to-limit", "a wait for a response up to the limit"};

// It is its cause.
constexpr std::string_view kAfter[] = {"frame-lost"};

constexpr RuleInfo kInfo{.id = "mailbox-no-response",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "A mailbox request gets no response",
                         .needs = "both directions, time stamps, and a master that polls for the response",
                         .source = "ETG1000.4, mailbox; ESC-1, mailbox",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the slave answers each request that needs a response within the limit of 1 s: SDO, SDO information, FoE, SoE,
AoE, and IP settings of EoE.

## Why it matters
The master waits until its time-out, and the request has no effect.

## How it is decided
The request never got a response, and one of these is true:

- The master polled until the limit was over: it read the mailbox, or its status 0x080D, and found it empty.
- The master gave up earlier, but after at least half of the limit: it sent another request, took the slave to INIT, or
  did not poll for longer than the limit. SOEM gives up after 700 ms.

A late response is a response, however late it is. It is reported as slow-response if all of these hold:

- The mailbox was still empty at the limit.
- At least 2 other responses of the slave took a tenth of that wait at most.
- The request is an SDO request, but no download of 1010h, 1011h or 1023h. Other downloads may store parameters, too:
  for the objects of the manufacturer (2000h to 5FFFh) it is an info.

Further:

- An answer in several parts (SDO information, SoE) that stops has its own kind: the wait counts from the last part.
- A request that is written after the master requested a state out of INIT, and before AL Status showed it, has its own
  kind: the mailbox was not active yet. If AL Status was not read in between, that is inferred, and only for requests
  within the time that the slave may take.
- The status of the out mailbox (0x0805) shows whether the slave read the request: if it is still full, it did not.
- An out mailbox is reported, too, if it is full at each poll until the limit is over and the capture does not show how
  it was filled (before the capture, or in a capture gap). After a capture gap the wait counts as long as nothing is
  written, because only a write fills the mailbox.
- While no message comes out of the mailbox of a slave, all of its requests without a response are one finding.
- If a frame that read the mailbox never returned, the response may have been in it: the finding is inferred, and
  caused_by names frame-lost.
- If frames are missing from the capture while a request is open, the request is not evaluated.

## Example
samples/captures/mailbox-no-response.pcapng: an upload of 1018h:1; the out mailbox is still full at the end.

## What to do
- Out mailbox still full: the slave's processor does not run, or does not serve its mailbox in this state.
- Request read, but not answered: compare its counter with that of the request before (if equal, the slave drops it as a
  repetition); otherwise check the slave.

The limit can be changed in the configuration file: mailbox-no-response (milliseconds).
)"};

class MailboxNoResponse final : public Rule {
 public:
  MailboxNoResponse() : Rule(kInfo) {
    Subscribe<mailbox::MailboxUnanswered>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxAnswered>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxReadLost>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxMessage>(&MailboxNoResponse::On);
    Subscribe<mailbox::SdoUnexpected>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxStuck>(&MailboxNoResponse::On);
    Subscribe<model::AlRequestJudged>(&MailboxNoResponse::On);
  }

  void On(const mailbox::MailboxUnanswered& e) {
    const FrameRef& request = e.request.frame;
    switch (EvaluateWait(context(), e)) {
      case WaitVerdict::kGap:
        NotEvaluable(e.slave, ReasonCode::kMissesPackets, kResponse, request.number);
        return;
      case WaitVerdict::kNeverPolled:
        NotEvaluable(e.slave, ReasonCode::kNotRead, kMailboxAfterRequest, request.number);
        return;
      case WaitVerdict::kNoTime:
        NotEvaluable(e.slave, ReasonCode::kNoStamps, request.number);
        return;
      case WaitVerdict::kTooShort:
        NotEvaluable(e.slave, ReasonCode::kNotInCapture, kLongWait, request.number);
        return;
      case WaitVerdict::kUnanswered:
        break;
    }
    std::uint64_t key = RequestKey(e.request) | (e.not_accepted ? 1ULL << 40U : 0U) | (e.read_lost ? 1ULL << 41U : 0U) |
                        (e.parts > 0 ? 1ULL << 44U : 0U);
    Silence& silence = SilenceOf(e.slave);
    if (silence.finding != kNoFinding && !e.read_lost) key = silence.key;
    FindingIndex index = Repeat(e.slave, key, request);
    if (index == kNoFinding) index = Report(key, Describe(e, silence));
    if (index == kNoFinding) return;
    if (silence.finding == index) {
      ++silence.further;
      silence.last = e.request;
    } else if (!e.read_lost && e.certainty == Certainty::kObserved) {
      silence.finding = index;
      silence.key = key;
    }
    AddRelated(context().store[index], e.last_poll.number);
    context().ExplainRequest(e.slave, request.number, index);
    const FrameNo until = e.ended.seen() ? e.ended.number : ~FrameNo{0};
    reported_[next_reported_++ % reported_.size()] = {e.slave, index,           request.number,
                                                      until,   e.request.index, e.request.subindex};
    if ((e.read_lost || e.certainty == Certainty::kUnknown) && lost_.size() < FindingStore::kMaxFindings)
      lost_.push_back({e.slave, index, request.number, until, {}, {}});
  }

  /// The master waited long enough, so nothing failed.
  void On(const mailbox::MailboxAnswered& e) {
    if (!e.request.frame.has_time || !e.answer.has_time || e.read_lost) return;
    Pace& pace = PaceOf(e.slave);
    const bool waited = e.last_poll.seen() && e.last_poll.has_time;
    FrameRef since = e.since;
    const TimeNs waited_ns = waited ? Elapsed(since.time, e.last_poll.time) : 0;
    if (waited_ns < context().Limit("mailbox-no-response", kMailboxAnswerLimit)) {
      ++pace.responses;
      FollowClock(since, waited ? e.last_poll : since, e.answer);
      pace.longest_ns = std::max(pace.longest_ns, Elapsed(since.time, e.answer.time));
      return;
    }
    if (IsSdo(e.request) && !IsStoring(e.request) && pace.slow.size() < kMostSlow) pace.slow.push_back({e, waited_ns});
  }

  /// The problem may have begun before the capture.
  void On(const mailbox::MailboxStuck& e) {
    if (!e.since().has_time || !e.last.has_time) return;
    const std::int64_t wait = Elapsed(e.since().time, e.last.time);
    const std::int64_t limit = context().Limit("mailbox-no-response", kMailboxAnswerLimit);
    if (wait < (e.reset ? limit / 2 : limit)) return;
    constexpr std::uint64_t kStuckKey = 1ULL << 42U;
    FindingIndex index = Repeat(e.slave, kStuckKey, e.since());
    if (index == kNoFinding) index = Report(kStuckKey, DescribeStuck(e, wait));
    if (index != kNoFinding) AddRelated(context().store[index], e.last.number);
  }

  /// The mailbox of the slave works: later requests without an answer belong to another finding.
  void On(const mailbox::MailboxMessage& m) {
    Silence& silence = SilenceOf(m.slave);
    if (m.direction == mailbox::Direction::kIn) {
      BreakSilence(silence, m.frame().number);
    } else {
      const model::AlMachine& al = context().slave(m.slave).al;
      const bool early = silence.requested_frame.seen() && al.possible().contains(kInit);
      silence.sent[1] =
          std::exchange(silence.sent[0], {m.frame().number, m.counter_step, early, early && al.wait().polls == 0,
                                          silence.requested, silence.requested_frame});
    }
  }

  /// A request out of INIT: until the slave shows its answer, the mailbox may not be active yet.
  void On(const model::AlRequestJudged& e) {
    Silence& silence = SilenceOf(e.slave);
    silence.requested = e.request.control.state();
    silence.requested_frame = silence.requested == kInit ? FrameRef{} : e.request.frame;
  }

  /// An answer after the master gave up.
  void On(const mailbox::SdoUnexpected& e) {
    if (e.reason == mailbox::SdoUnexpected::Reason::kWrongCommand || !e.has_object) return;
    for (const LostRead& r : reported_) {
      if (r.finding == kNoFinding || r.slave != e.slave || r.index != e.index || r.subindex != e.subindex) continue;
      Finding& finding = context().store[r.finding];
      if (e.response.number <= r.from || finding.count > 1) continue;
      std::erase_if(finding.notes, [](const Note& note) { return IsOfSilentSlave(*note.kind); });
      Arguments late{{"response_frame", arg::Frame(e.response.number)}};
      if (e.response.has_time && finding.first.has_time) {
        late.Set("late_ms", arg::Ms(Elapsed(finding.first.time, e.response.time)));
      }
      finding.Add(kLateResponse, std::move(late)).Set("advice", arg::Of(kLongerTimeOut));
      AddRelated(finding, e.response.number);
      return;
    }
  }

  /// A lost frame may be detected only after the master gave up.
  void On(const mailbox::MailboxReadLost& e) {
    for (const LostRead& r : reported_) {
      if (r.finding == kNoFinding || r.slave != e.slave || e.frame.number <= r.from || e.frame.number >= r.until)
        continue;
      Finding& finding = context().store[r.finding];
      if (finding.confidence == Confidence::kInferred) continue;
      finding.confidence = Confidence::kInferred;
      if (std::erase_if(finding.notes, [](const Note& note) { return IsOfSilentSlave(*note.kind); }) > 0) {
        finding.Set("advice", arg::Of(kRepeatRead));
      }
      finding.Add(kReadLost, {{"lost_frame", arg::Frame(e.frame.number)}});
      AddRelated(finding, e.frame.number);
      lost_.push_back(r);
    }
  }

  void Finish() override {
    for (Silence& silence : silences_) BreakSilence(silence, 0);
    for (const Pace& pace : paces_) ReportSlow(pace);
    if (NotEvaluableWithoutReturns()) return;
    std::vector<Finding>& findings = context().store.findings();
    for (std::size_t i = 0; i < findings.size(); ++i) {
      if (findings[i].rule != "frame-lost") continue;
      for (const LostRead& lost : lost_) {
        if (findings[lost.finding].caused_by != kNoFinding) continue;
        if (findings[i].first.number < lost.until && findings[i].last.number >= lost.from) {
          findings[lost.finding].caused_by = static_cast<FindingIndex>(i);
          // The answer may be among frames that the capture misses.
          if (findings[i].severity == Severity::kInfo) context().store.Regrade(lost.finding, Severity::kInfo);
        }
      }
    }
  }

 private:
  static constexpr auto kInit = static_cast<std::uint8_t>(esc::AlState::INIT);

  struct LostRead {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
    FrameNo from = 0, until = 0;
    std::optional<std::uint16_t> index;  ///< object of the request
    std::optional<std::uint8_t> subindex;
  };

  /// No message came out of a mailbox since a request to it was not answered.
  struct Silence {
    FindingIndex finding = kNoFinding;
    std::uint64_t key = 0;
    std::uint64_t further = 0;     ///< requests without an answer after the first
    mailbox::RequestSummary last;  ///< of these
    struct Sent {
      FrameNo frame = 0;
      mailbox::CounterStep step = mailbox::CounterStep::kUnknown;
      bool early = false;   ///< the slave was not seen to have left INIT
      bool unread = false;  ///< AL Status was not read between the request of the state and this message
      // The state requested then: that the message has no answer may show after the next request.
      std::uint8_t requested = 0;
      FrameRef requested_frame;
    };
    std::array<Sent, 2> sent{};  ///< the newest messages of the master
    // The last request of a state.
    std::uint8_t requested = 0;
    FrameRef requested_frame;
  };

  /// How long the slave takes.
  struct Pace {
    struct Slow {
      mailbox::MailboxAnswered answered;
      TimeNs waited_ns = 0;
    };
    std::uint64_t responses = 0;  ///< within the limit ...
    TimeNs longest_ns = 0;        ///< ... and the longest wait for one
    std::vector<Slow> slow;       ///< at most kMostSlow
  };
  static constexpr std::size_t kMostSlow = 16;

  Pace& PaceOf(SlaveId slave) {
    if (slave >= paces_.size()) paces_.resize(static_cast<std::size_t>(slave) + 1);
    return paces_[slave];
  }

  /// Files are stored as they arrive (FoE): that takes long, too.
  static bool IsSdo(const mailbox::RequestSummary& request) {
    return request.protocol == mailbox::Protocol::kCoE &&
           request.operation == static_cast<std::uint8_t>(mailbox::CoeService::kSdoRequest);
  }
  static bool IsDownload(const mailbox::RequestSummary& request) {
    return IsSdo(request) &&
           mailbox::KindOf(request.command, mailbox::Direction::kOut) == mailbox::SdoKind::kDownloadInitiate;
  }
  /// Parameters are stored or set back, or a command is carried out: that takes long.
  static bool IsStoring(const mailbox::RequestSummary& request) {
    constexpr std::uint16_t kStore = 0x1010, kRestore = 0x1011, kCommand = 0x1023;
    return IsDownload(request) && (request.index == kStore || request.index == kRestore || request.index == kCommand);
  }
  /// An object of the manufacturer may do so as well.
  static bool MayStore(const mailbox::RequestSummary& request) {
    constexpr unsigned kFirst = 2, kLast = 5;  // thousands (hexadecimal) of its area
    const unsigned area = request.index.value_or(0) >> 12U;
    return IsDownload(request) && area >= kFirst && area <= kLast;
  }

  void ReportSlow(const Pace& pace) {
    constexpr std::uint64_t kSlowKey = 1ULL << 43U;
    constexpr std::uint64_t kEnough = 2;
    constexpr TimeNs kMuchSlower = 10;
    if (pace.responses < kEnough) return;
    for (const auto& [e, waited_ns] : pace.slow) {
      const std::uint64_t key = RequestKey(e.request) | kSlowKey;
      if (pace.longest_ns * kMuchSlower > waited_ns || Repeat(e.slave, key, e.request.frame) != kNoFinding) continue;
      Finding finding = Found(kSlow, e.slave, e.request.frame);
      SetRequest(finding.arguments, e.request);
      finding.Set("waited_ms", arg::Ms(waited_ns))
          .Set("last_poll_frame", arg::Frame(e.last_poll.number))
          .Set("response_frame", arg::Frame(e.answer.number))
          .Set("others", arg::Count(pace.responses, "other response"))
          .Set("usual_ms", arg::Ms(pace.longest_ns))
          .Set("may_store", arg::Flag(MayStore(e.request)));
      AddRelated(finding, e.last_poll.number);
      AddRelated(finding, e.answer.number);
      Report(key, MayStore(e.request) ? Severity::kInfo : Severity::kWarning, std::move(finding));
    }
  }

  Silence& SilenceOf(SlaveId slave) {
    if (slave >= silences_.size()) silences_.resize(static_cast<std::size_t>(slave) + 1);
    return silences_[slave];
  }

  /// @param until  frame of the message that came out of the mailbox; 0: none
  void BreakSilence(Silence& silence, FrameNo until) {
    if (silence.finding != kNoFinding && silence.further > 0) {
      Arguments further{{"further", arg::Count(silence.further, "further request")},
                        {"last_request_frame", arg::Frame(silence.last.frame.number)}};
      SetRequest(further, silence.last);
      if (until != 0) further.Set("until_frame", arg::Frame(until));
      context().store[silence.finding].Add(kFurther, std::move(further));
    }
    silence.finding = kNoFinding;
    silence.further = 0;
  }

  /// The slave read the request and does not answer.
  static bool IsOfSilentSlave(const NoteKind& kind) {
    return &kind == &kReadCounterRight || &kind == &kReadCounterEqual || &kind == &kRead;
  }

  /// The message with the request; null if newer ones have taken its place.
  static const Silence::Sent* SentOf(const mailbox::MailboxUnanswered& e, const Silence& silence) {
    for (const Silence::Sent& sent : silence.sent) {
      if (sent.frame == e.request.frame.number) return &sent;
    }
    return nullptr;
  }
  static mailbox::CounterStep StepOf(const mailbox::MailboxUnanswered& e, const Silence& silence) {
    const Silence::Sent* sent = SentOf(e, silence);
    return sent == nullptr ? mailbox::CounterStep::kUnknown : sent->step;
  }

  static Finding DescribeStuck(const mailbox::MailboxStuck& e, std::int64_t wait) {
    Finding finding = Found(kStuck, e.slave, e.since());
    finding.Set("waited_ms", arg::Ms(wait))
        .Set("looks", arg::Count(e.looks, "poll"))
        .Set("out_mailbox_full", arg::Boolean(true))
        .Set("once", arg::Flag(e.looks == 1))
        .Set("first_poll_frame", arg::Frame(e.first.number))
        .Set("last_poll_frame", arg::Frame(e.last.number));
    if (e.gap.seen()) finding.Set("gap_frame", arg::Frame(e.gap.number));
    return finding;
  }

  /// It may be that the slave had not reached the state when the message was written. Where AL Status was not read,
  /// only within the time that the slave may take.
  [[nodiscard]] bool MayBeTooEarly(const mailbox::MailboxUnanswered& e, const Silence& silence) const {
    const Silence::Sent* sent = SentOf(e, silence);
    if (sent == nullptr || !sent->early || e.read_lost) return false;
    const FrameRef& asked = sent->requested_frame;
    if (!sent->unread || !asked.has_time || !e.request.frame.has_time) return true;
    const TimeNs limit = context().slave(e.slave).al.timeouts().To(sent->requested, false);
    return Elapsed(asked.time, e.request.frame.time) <= limit;
  }

  [[nodiscard]] Finding Describe(const mailbox::MailboxUnanswered& e, const Silence& silence) const {
    using End = mailbox::MailboxUnanswered::End;
    const Silence::Sent* sent = SentOf(e, silence);
    const bool in_part = e.parts > 0;
    const bool too_early = !in_part && MayBeTooEarly(e, silence);
    Finding finding = Found(in_part ? kInPart : too_early ? kTooEarly : kNoResponse, e.slave, e.request.frame);
    if (too_early) {
      const FrameRef& asked = sent->requested_frame;
      finding.Set("requested", arg::State(sent->requested))
          .Set("state_frame", arg::Frame(asked.number))
          .Set("unread", arg::Flag(sent->unread));
      if (asked.has_time && e.request.frame.has_time) {
        finding.Set("after_us", arg::Us(Elapsed(asked.time, e.request.frame.time)));
      }
      AddRelated(finding, asked.number);
    }
    const bool inferred = e.read_lost || (too_early && sent->unread);
    finding.confidence = inferred ? Confidence::kInferred : ConfidenceOf(e.certainty);
    SetRequest(finding.arguments, e.request);
    finding.Set("waited_ms", arg::Ms(WaitOf(e).value_or(0)))
        .Set("polls", arg::Count(e.polls, "poll"))
        .Set("out_mailbox_full", arg::Boolean(e.not_accepted))
        .Set("read_lost", arg::Boolean(e.read_lost));
    if (e.polls > 0) finding.Set("last_poll_frame", arg::Frame(e.last_poll.number));
    if (e.end == End::kNextRequest) {
      finding.Set("next_request_frame", arg::Frame(e.ended.number));
    } else if (e.end == End::kReset && e.ended.seen()) {
      finding.Set("reset_frame", arg::Frame(e.ended.number));
    }
    if (in_part) {
      finding.Set("parts", arg::Count(e.parts, "part")).Set("last_part_frame", arg::Frame(e.last_part.number));
      AddRelated(finding, e.last_part.number);
      if (e.read_lost) finding.Add(kResponseLost);
    }
    if (in_part || too_early) return finding;
    const auto [note, advice] = FateOf(e, silence);
    finding.Add(*note).Set("advice", arg::Of(*advice));
    return finding;
  }

  /// What happened to the request, and what to do.
  static std::pair<const NoteKind*, const Word*> FateOf(const mailbox::MailboxUnanswered& e, const Silence& silence) {
    if (e.not_accepted) return {&kStillFull, &kCheckProcessor};
    if (e.read_lost) return {&kResponseLost, &kRepeatRead};
    if (e.certainty == Certainty::kUnknown) return {&kRequestLost, &kFindLoss};
    if (!e.taken) return {&kNotKnownIfRead, &kReadStatus};
    switch (StepOf(e, silence)) {
      case mailbox::CounterStep::kNext:
        return {&kReadCounterRight, &kCheckSlave};
      case mailbox::CounterStep::kSame:
        return {&kReadCounterEqual, &kAdvanceCounter};
      default:
        return {&kRead, &kCompareCounters};
    }
  }

  std::vector<LostRead> lost_;
  std::vector<Silence> silences_;        // by slave
  std::vector<Pace> paces_;              // likewise
  std::array<LostRead, 16> reported_{};  // the newest
  std::size_t next_reported_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxNoResponse>};

}  // namespace
}  // namespace ecaudit::mailbox_no_response
