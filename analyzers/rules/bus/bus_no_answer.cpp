#include <algorithm>
#include <array>
#include <utility>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/time.h"
#include "decoder/bus/direction.h"
#include "decoder/pipeline.h"

namespace ecaudit::bus_no_answer {
namespace {

/// At least this number of frames without a return, for this time: longer than any frame is in flight, and masters wait
/// for one.
constexpr std::uint64_t kEnoughFrames = 3;
constexpr std::int64_t kLongEnoughNs = 20'000'000;

constexpr std::uint64_t kForGood = 0;
constexpr std::uint64_t kBeforeFirst = 1;

constexpr FindingKind kNever{
    .name = "never",
    .title = "No frame returns: no slave answers",
    .message = R"(The master repeats its frames after a time-out. It sent {frames}[{?timed} within {silence_ms}], and
none returned.)",
    .next = R"(Check the cable between the master and the first slave, the port of the master, and the power of the
first slave.)"};
constexpr FindingKind kStopped{
    .name = "stopped",
    .title = "No frame returns any more: no slave answers",
    .message = R"(The last returned frame is {last_returned_frame}. From {frame} on the master sent
{frames}[{?timed} within {silence_ms}], and none returned.)",
    .next = R"(Check the cable between the master and the first slave, the port of the master, and the power of the
first slave.)"};
constexpr FindingKind kLate{
    .name = "late-first-return",
    .title = "{frames} {frames?was|were} sent before the first one returned",
    .message = R"(The master sent {frames} before the first one that returned, {first_returned_frame}. The slaves were
switched on later, the link came up late, or the capture has no returns at its beginning.)",
    .next = "If the slaves were on before, check the link between the master and the first slave."};
constexpr const FindingKind* kKinds[] = {&kNever, &kStopped, &kLate};

constexpr RuleInfo kInfo{.id = "bus-no-answer",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "Frames are sent, and none returns",
                         .needs = "frames that the master repeats after a time-out, or earlier returns",
                         .source = "ETG1000.4, frame processing: each frame returns to its sender",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
- Outbound frames that are repeated after a time-out and never return, in the whole capture.
- Outbound frames that never return from some frame on until the end of the capture.
- Outbound frames that are sent before the first slave answers.

## Why it matters
The ring is open towards the master. No slave gets data, and slaves in OP drop to SAFEOP by their watchdogs.

## How it is decided
If no frame ever returned, the master must have repeated frames under one index after a pause. Otherwise the capture may
have one direction only (capture-one-direction).

If frames returned before, at least three frames within at least 20 ms must follow the last return. Only masters whose
frames returned before count: the returns of others may be missing from the capture. In a capture that misses packets,
they must also be more than twice the longest earlier row of frames without a return.

At least three frames in more than 50 ms before the first return are an info: the slaves may have been switched on later
than the master.

## Example
tests/rules/bus-no-answer/violates.trace

## What to do
Check the cable between the master and the first slave, the port of the master (link, right interface), and the power of
the first slave.
)"};

constexpr Word kReturnsAtEnd{"returns-at-end", "the returns at the end of the capture", true};
constexpr Word kReturnsOfLastSender{"returns-of-last-sender", "the returns of the master that sent last", true};

class BusNoAnswer final : public Rule {
 public:
  BusNoAnswer() : Rule(kInfo) { Subscribe<FrameSeen>(&BusNoAnswer::On); }

  void On(const FrameSeen& e) {
    // A frame that cannot be read, but may have passed slaves, counts as returned.
    if (e.direction == bus::Direction::kReturned || e.direction == bus::Direction::kByPair) {
      if (!last_returned_.seen()) {
        first_returned_ = e.frame.ref();
        first_unanswered_ = since_.first;
        last_unanswered_ = sent_before_last_;
      } else {
        longest_row_ = std::max(longest_row_, since_.count);
      }
      last_returned_ = e.frame.ref();
      AddAnswered(e.frame.sender());
      since_.count = since_answered_.count = 0;
    } else if (e.direction == bus::Direction::kOutbound) {
      sent_before_last_ = since_.last.seen() ? since_.last : e.frame.ref();
      since_.Add(e.frame.ref());
      if (WasAnswered(e.frame.sender())) since_answered_.Add(e.frame.ref());
    }
  }

  void Finish() override {
    const bus::PairingStatistics& pairing = context().pairing();
    if (pairing.outbound == 0) {
      NotEvaluableWithoutSent();
      return;
    }
    const bool ever = pairing.returned > 0;
    if (!ever && !pairing.no_answers) return NotEvaluable(kNoSlave, ReasonCode::kNoReturnedFrames);
    ReportLate(pairing);
    // The returns of a sender whose frames never returned may be missing from the capture; unless returned frames have
    // another address than sent ones.
    const Sent& sent = since_answered_.first.seen() ? since_answered_ : since_;
    if (pairing.undecided[static_cast<std::size_t>(bus::Undecided::kNoReturns)] > 0 && since_.count >= kEnoughFrames &&
        !since_answered_.first.seen() && ever) {
      NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kReturnsOfLastSender, since_.first.number);
      return;
    }
    if (sent.count < kEnoughFrames) return;
    const bool timed = sent.first.has_time && sent.last.has_time;
    const std::int64_t silence = timed ? Elapsed(sent.first.time, sent.last.time) : 0;
    if (ever && silence < kLongEnoughNs) return;
    if (ever && MissesPackets(pairing) && sent.count <= 2 * longest_row_) {
      return NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, kReturnsAtEnd, sent.first.number);
    }
    Finding finding = Found(ever ? kStopped : kNever, kNoSlave, sent.first);
    finding.last = sent.last;
    finding.count = sent.count;
    finding.Set("frames", arg::Count(sent.count, "frame"))
        .Set("silence_ms", arg::Ms(silence))
        .Set("timed", arg::Flag(timed));
    if (ever) {
      finding.Set("last_returned_frame", arg::Frame(last_returned_.number));
      AddRelated(finding, last_returned_.number);
    }
    Report(kForGood, std::move(finding));
  }

 private:
  struct Sent {
    std::uint64_t count = 0;
    FrameRef first, last;
    void Add(const FrameRef& frame) {
      if (count++ == 0) first = frame;
      last = frame;
    }
  };

  void AddAnswered(std::uint64_t sender) {
    if (answered_count_ < answered_.size() && !WasAnswered(sender)) answered_[answered_count_++] = sender;
  }
  [[nodiscard]] bool WasAnswered(std::uint64_t sender) const {
    const auto end = answered_.begin() + static_cast<std::ptrdiff_t>(answered_count_);
    return std::find(answered_.begin(), end, sender) != end;
  }

  void ReportLate(const bus::PairingStatistics& pairing) {
    const std::uint64_t unanswered = pairing.undecided[static_cast<std::size_t>(bus::Undecided::kNoAnswers)];
    if (unanswered == 0 || !first_returned_.seen() || !first_unanswered_.seen()) return;
    Finding finding = Found(kLate, kNoSlave, first_unanswered_);
    finding.last = last_unanswered_;
    finding.count = unanswered;
    finding.Set("frames", arg::Count(unanswered, "frame"))
        .Set("first_returned_frame", arg::Frame(first_returned_.number));
    AddRelated(finding, first_returned_.number);
    const FindingIndex index = Report(kBeforeFirst, std::move(finding));
    if (index != kNoFinding) context().store.Regrade(index, Severity::kInfo);
  }

  FrameRef first_returned_, first_unanswered_, last_unanswered_, sent_before_last_;
  FrameRef last_returned_;
  std::array<std::uint64_t, 2 * bus::DirectionLearner::kMaxMasters> answered_{};  ///< whose frames returned
  std::size_t answered_count_ = 0;
  Sent since_, since_answered_;    ///< after the last return: of all senders, and of those
  std::uint64_t longest_row_ = 0;  ///< of frames between two returns
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusNoAnswer>};

}  // namespace
}  // namespace ecaudit::bus_no_answer
