#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::mailbox_no_response {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-no-response",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .title = "A mailbox request gets no response",
                         .needs = "both directions, time stamps, and a master that looks for the answer",
                         .source = "ETG1000.4, mailbox; ESC-1, mailbox",
                         .doc = R"(
## What it checks
Whether a request that a slave has to answer (SDO, SDO information, FoE, SoE, AoE, IP settings of EoE) is answered
within the limit of 1 s.

## Why it matters
The master is stuck until its time-out, and what was requested did not happen.

## How it is decided
The request never got an answer, and the master looked for one (it read the mailbox, or its status 0x080D, and found it
empty) until the limit was over; or it gave up earlier, after half of the limit at the least: it sent another request,
took the slave to INIT, or looked no more for longer than the limit. SOEM gives up after 700 ms. An answer that comes
late, however late, is an answer.
The status of the out mailbox (0x0805) tells whether the slave took the request at all: still full, it did not. So does
a mailbox that is full at each look until the limit is over and of which the capture does not show how it was filled:
it was before the capture, or packets are missing. Behind these the wait counts as long as nothing is written, for only
a write fills it.
While nothing comes out of the mailbox of a slave, all of its requests without an answer are one finding.
Where a frame that read the mailbox never came back, the answer may have been in it: the finding is marked inferred and
caused_by names frame-lost. Where frames are missing from the capture while a request is open, nothing else is said.

## Example
samples/captures/mailbox-no-response.pcapng: an upload of 1018h:1; the out mailbox is still full at the end.

## What to do
Out mailbox still full: the slave's processor does not run, or does not serve its mailbox in this state. Taken but not
answered: counter of the request equal to the one before (the slave drops it as a repetition), or a fault of the slave.
The limit can be changed in the configuration file: mailbox-no-response (milliseconds).
)"};

class MailboxNoResponse final : public Rule {
 public:
  MailboxNoResponse() : Rule(kInfo) {
    Subscribe<mailbox::MailboxUnanswered>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxReadLost>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxMessage>(&MailboxNoResponse::On);
    Subscribe<mailbox::SdoUnexpected>(&MailboxNoResponse::On);
    Subscribe<mailbox::MailboxStuck>(&MailboxNoResponse::On);
  }

  void On(const mailbox::MailboxUnanswered& e) {
    const FrameRef& request = e.request.frame;
    switch (JudgeWait(context(), e)) {
      case WaitVerdict::kGap:
        NotEvaluable(e.slave, "frames are missing from the capture while a request was open", request.number);
        return;
      case WaitVerdict::kNeverLooked:
        NotEvaluable(e.slave, "the master never looked for the answer to a request", request.number);
        return;
      case WaitVerdict::kNoTime:
        NotEvaluable(e.slave, "a request without an answer has no time stamp", request.number);
        return;
      case WaitVerdict::kTooShort:
        NotEvaluable(e.slave, "the wait for an answer ended before the limit", request.number);
        return;
      case WaitVerdict::kUnanswered:
        break;
    }
    std::uint64_t key = RequestKey(e.request) | (e.not_taken ? 1ULL << 40U : 0U) | (e.read_lost ? 1ULL << 41U : 0U);
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

  /// What is wrong need not have begun in the capture.
  void On(const mailbox::MailboxStuck& e) {
    if (!e.since().has_time || !e.last.has_time) return;
    const std::int64_t wait = Elapsed(e.since().time, e.last.time);
    const std::int64_t limit = context().Limit("mailbox-no-response", kMailboxAnswerLimit);
    if (wait < (e.reset ? limit / 2 : limit)) return;
    constexpr std::uint64_t kStuck = 1ULL << 42U;
    FindingIndex index = Repeat(e.slave, kStuck, e.since());
    if (index == kNoFinding) index = Report(kStuck, DescribeStuck(e, wait));
    if (index != kNoFinding) AddRelated(context().store[index], e.last.number);
  }

  /// Its mailbox works: what is not answered from here on is another matter.
  void On(const mailbox::MailboxMessage& m) {
    Silence& silence = SilenceOf(m.slave);
    if (m.direction == mailbox::Direction::kIn) {
      BreakSilence(silence, m.frame().number);
    } else {
      silence.sent[1] = std::exchange(silence.sent[0], {m.frame().number, m.counter_step});
    }
  }

  /// An answer that nobody waits for any more.
  void On(const mailbox::SdoUnexpected& e) {
    if (e.reason == mailbox::SdoUnexpected::Reason::kWrongCommand || !e.has_object) return;
    for (const LostRead& r : reported_) {
      if (r.finding == kNoFinding || r.slave != e.slave || r.index != e.index || r.subindex != e.subindex) continue;
      Finding& finding = context().store[r.finding];
      if (e.response.number <= r.from || finding.count > 1) continue;
      const std::string after = e.response.has_time && finding.first.has_time
                                    ? ", " + Duration(Elapsed(finding.first.time, e.response.time)) + " after it"
                                    : std::string();
      if (const std::size_t at = finding.message.find(kTakenAndSilent); at != std::string::npos) {
        finding.message.resize(at);
      } else {
        finding.message += ' ';
      }
      finding.message += "The answer came in frame " + std::to_string(e.response.number) + after +
                         ": the slave is slower than the time-out of the master.";
      AddRelated(finding, e.response.number);
      return;
    }
  }

  /// That a frame was lost may show only after its answer was given up.
  void On(const mailbox::MailboxReadLost& e) {
    for (const LostRead& r : reported_) {
      if (r.finding == kNoFinding || r.slave != e.slave || e.frame.number <= r.from || e.frame.number >= r.until)
        continue;
      Finding& finding = context().store[r.finding];
      if (finding.confidence == Confidence::kInferred) continue;
      finding.confidence = Confidence::kInferred;
      finding.message += " Frame " + std::to_string(e.frame.number) +
                         ", which read the mailbox, never came back: the answer was probably lost with it.";
      AddRelated(finding, e.frame.number);
      lost_.push_back(r);
    }
  }

  void Finish() override {
    for (Silence& silence : silences_) BreakSilence(silence, 0);
    if (NotEvaluableWithoutReturns()) return;
    std::vector<Finding>& findings = context().store.findings();
    for (std::size_t i = 0; i < findings.size(); ++i) {
      if (findings[i].rule != "frame-lost") continue;
      for (const LostRead& lost : lost_) {
        if (findings[lost.finding].caused_by != kNoFinding) continue;
        if (findings[i].first.number < lost.until && findings[i].last.number >= lost.from) {
          findings[lost.finding].caused_by = static_cast<FindingIndex>(i);
          // Where the capture misses frames, the answer may be among them.
          if (findings[i].severity == Severity::kInfo) context().store.Regrade(lost.finding, Severity::kInfo);
        }
      }
    }
  }

 private:
  struct LostRead {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
    FrameNo from = 0, until = 0;
    std::optional<std::uint16_t> index;  ///< object that was asked for
    std::optional<std::uint8_t> subindex;
  };

  /// Nothing came out of a mailbox since a request of it was not answered.
  struct Silence {
    FindingIndex finding = kNoFinding;
    std::uint64_t key = 0;
    std::uint64_t further = 0;     ///< requests without an answer after the first
    mailbox::RequestSummary last;  ///< of these
    struct Sent {
      FrameNo frame = 0;
      mailbox::CounterStep step = mailbox::CounterStep::kUnknown;
    };
    std::array<Sent, 2> sent{};  ///< the newest messages of the master
  };

  Silence& SilenceOf(SlaveId slave) {
    if (slave >= silences_.size()) silences_.resize(static_cast<std::size_t>(slave) + 1);
    return silences_[slave];
  }

  /// @param until  frame of what came out of the mailbox; 0: nothing did
  void BreakSilence(Silence& silence, FrameNo until) {
    if (silence.finding != kNoFinding && silence.further > 0) {
      context().store[silence.finding].message +=
          " Nothing came out of this mailbox " +
          (until != 0 ? "until frame " + std::to_string(until) : std::string("afterwards")) + ": " +
          Count(silence.further, "further request") + " had no answer, the last of them " + RequestText(silence.last) +
          " in frame " + std::to_string(silence.last.frame.number) + ".";
    }
    silence.finding = kNoFinding;
    silence.further = 0;
  }

  static constexpr std::string_view kTakenAndSilent = "The slave took the request and does not answer it";

  /// Whether the slave may have taken it for a repetition.
  static std::string CounterText(const mailbox::MailboxUnanswered& e, const Silence& silence) {
    for (const Silence::Sent& sent : silence.sent) {
      if (sent.frame != e.request.frame.number) continue;
      if (sent.step == mailbox::CounterStep::kNext)
        return ". Its mailbox counter is right, so look for a fault of the slave.";
      if (sent.step == mailbox::CounterStep::kSame) {
        return ": it has the mailbox counter of the request before, so the slave takes it for a repetition and drops "
               "it.";
      }
    }
    return ": look for an equal mailbox counter in the request before, else for a fault of the slave.";
  }

  static Finding DescribeStuck(const mailbox::MailboxStuck& e, std::int64_t wait) {
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.since();
    finding.title = "A message stands in the out mailbox for " + Duration(wait) + ", and nobody takes it";
    const std::string first = std::to_string(e.first.number), last = std::to_string(e.last.number);
    finding.message =
        "The out mailbox (0x0805) was full " +
        (e.looks == 1 ? "when the master looked, in frame " + last
                      : "at each of " + Count(e.looks, "look") + " from frame " + first + " to frame " + last) +
        ", and no message came from the slave. ";
    finding.message += e.hole.seen() ? "Nothing was written there from frame " + std::to_string(e.hole.number) +
                                           " on; what was before, the capture does not show. "
                                     : "What was written there is not in the capture. ";
    finding.message += "The slave's processor does not run, or does not serve the mailbox.";
    finding.evidence = {Real("waited_ms", static_cast<double>(wait) / 1e6),
                        Number("looks", static_cast<std::int64_t>(e.looks)),
                        {"out_mailbox_full", true, Evidence::Notation::kDecimal}};
    return finding;
  }

  static Finding Describe(const mailbox::MailboxUnanswered& e, const Silence& silence) {
    using End = mailbox::MailboxUnanswered::End;
    const std::int64_t wait = WaitOf(e).value_or(0);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.request.frame;
    finding.confidence = e.read_lost ? Confidence::kInferred : ConfidenceOf(e.certainty);
    finding.title = "No response to " + RequestText(e.request) + " within " + Duration(wait);
    finding.message =
        "The master wrote " + RequestText(e.request) + " in frame " + std::to_string(e.request.frame.number) + " and ";
    if (e.polls > 0) {
      finding.message += "found no answer in " + Count(e.polls, "look") + " over " + Duration(wait) +
                         " (the last in frame " + std::to_string(e.last_poll.number) + ")";
    } else {
      finding.message += "got no answer";
    }
    if (e.end == End::kNextRequest) {
      finding.message += ", then it went on with the next request in frame " + std::to_string(e.ended.number);
    } else if (e.end == End::kReset && e.ended.seen()) {
      finding.message += ", then the mailbox was reset in frame " + std::to_string(e.ended.number);
    }
    finding.message += ". ";
    if (e.not_taken) {
      finding.message +=
          "The out mailbox was still full at the last look (0x0805): the slave never took the request. Its processor "
          "does not run, or does not serve the mailbox.";
    } else if (e.read_lost) {
      finding.message +=
          "A frame that read the mailbox never came back meanwhile, so the answer was probably lost with it; a repeat "
          "request (bit 1 of 0x080E) has to bring it back.";
    } else if (e.certainty == Certainty::kUnknown) {
      finding.message += "The frame with the request itself never came back: the slave may not have got it.";
    } else if (!e.taken) {
      finding.message +=
          "Whether the slave took the request the capture does not show: the master did not look at its out mailbox "
          "(0x0805). Its processor does not serve the mailbox, or drops the request.";
    } else {
      finding.message += std::string(kTakenAndSilent) + CounterText(e, silence);
    }
    finding.evidence.push_back(Text("protocol", Name(e.request.protocol)));
    finding.evidence.push_back(Real("waited_ms", static_cast<double>(wait) / 1e6));
    finding.evidence.push_back(Number("polls", static_cast<std::int64_t>(e.polls)));
    finding.evidence.push_back({"out_mailbox_full", e.not_taken, Evidence::Notation::kDecimal});
    finding.evidence.push_back({"read_lost", e.read_lost, Evidence::Notation::kDecimal});
    return finding;
  }

  std::vector<LostRead> lost_;
  std::vector<Silence> silences_;        // by slave
  std::array<LostRead, 16> reported_{};  // the newest
  std::size_t next_reported_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxNoResponse>};

}  // namespace
}  // namespace ecaudit::mailbox_no_response
