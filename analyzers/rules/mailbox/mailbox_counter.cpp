#include <array>
#include <vector>

#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::mailbox_counter {
namespace {

constexpr FindingKind kRepeated{
    .name = "repeated",
    .title = "Mailbox counter {counter} {direction} after {before}, {expected} expected",
    .message = R"(The {protocol} message {direction} in {frame} has counter {counter}. The message before it, in
{before_frame}, has counter {before} too, so {expected} has to follow.[{?from_master} A slave treats a request with the
counter of the last one as a repetition and drops it.][{!from_master} A master may treat the message as a repetition and
drop it.])",
    .next = R"(Correct the [{?from_master}master][{!from_master}slave]: each new message needs the next counter.)",
    .identity = "direction"};

constexpr FindingKind kSkipped{
    .name = "skipped",
    .title = "Mailbox counter {counter} {direction} after {before}, {expected} expected",
    .message = R"(The {protocol} message {direction} in {frame} has counter {counter}. The message before it, in
{before_frame}, has counter {before}, so {expected} has to follow. [{?from_master}A message was lost, or the master
counts wrong.][{!from_master}A message of the slave was lost, or the slave counts wrong. Some slaves count emergencies
separately.])",
    .next = R"(Check for lost messages, then the counter of the [{?from_master}master][{!from_master}slave].)",
    .identity = "direction"};

constexpr const FindingKind* kKinds[] = {&kRepeated, &kSkipped};

constexpr RuleInfo kInfo{.id = "mailbox-counter",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "The mailbox counter does not advance through 1 to 7",
                         .needs = "two messages in the same direction without a capture gap between them",
                         .source = "ETG1000.4, mailbox; ESC-1, mailbox",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The counter in byte 5 of each mailbox message against that of the message before it in the same direction: 1 to 7, then
1 again.

## Why it matters
The counter shows the receiver whether a message is new or a repetition. A slave drops a request with the counter of the
last one, and the master waits for a response that never comes. A skipped number means that a message was lost.

## How it is decided
The counter has to be the next one. Not evaluated are:

- counter 0: the sender does not count (requests of IgH and TwinCAT)
- the first message after a start, a capture gap or a lost frame
- a request that is repeated with its counter, and the response to a repeat request
- slaves that respond with the counter of the request

The vendor manuals call these bits reserved. That is an error of the manuals: the drives count as in the standard.

## Example
samples/captures/mailbox-counter.pcapng: the response in frame 148 has counter 3 after 1.

## What to do
- Master: use one counter for all protocols of a slave, and start at 1 again after INIT.
- Slave: use one counter for all messages that it sends, including emergencies.
)"};

class MailboxCounter final : public Rule {
 public:
  MailboxCounter() : Rule(kInfo) {
    Subscribe<mailbox::MailboxMessage>(&MailboxCounter::On);
    Subscribe<mailbox::MailboxReadLost>(&MailboxCounter::On);
  }

  void On(const mailbox::MailboxMessage& m) {
    if (m.late) {
      deferred_.Lost(m.slave, m.frame().number);
      return;
    }
    if (m.slave >= last_.size()) last_.resize(static_cast<std::size_t>(m.slave) + 1);
    Last& last = last_[m.slave][static_cast<std::size_t>(m.direction)];
    const Last before = last;
    last = {m.header.counter, m.frame().number};
    const bool same = m.counter_step == mailbox::CounterStep::kSame;
    if (m.repeated || (!same && m.counter_step != mailbox::CounterStep::kSkipped)) return;
    if (m.direction == mailbox::Direction::kIn && m.counter_echoes_request) return;
    if (context().network().MayMissBetween(before.frame, m.frame().number)) {
      NotEvaluable(m.slave, ReasonCode::kCaptureGap, what::kHistory, m.frame().number);
      return;
    }
    const std::uint64_t key = static_cast<std::uint64_t>(m.direction) << 1U | (same ? 1U : 0U);
    const unsigned expected = mailbox::NextCounter(before.counter);
    Finding finding = Found(same ? kRepeated : kSkipped, m.slave, m.frame());
    finding.confidence = ConfidenceOf(m.window_inferred ? Certainty::kInferred : Certainty::kObserved);
    finding.Set("direction", DirectionValue(m.direction))
        .Set("protocol", ProtocolValue(m.header.protocol))
        .Set("counter", arg::Number(m.header.counter))
        .Set("expected", arg::Number(expected))
        .Set("before", arg::Number(before.counter))
        .Set("before_frame", arg::Frame(before.frame))
        .Set("from_master", arg::Flag(m.direction == mailbox::Direction::kOut));
    AddRelated(finding, before.frame);
    deferred_.Add({before.frame, key, std::move(finding)});
    deferred_.SettleOld([this](DeferredFinding&& d) { Settle(std::move(d)); });
  }

  void On(const mailbox::MailboxReadLost& e) { deferred_.Lost(e.slave, e.frame.number); }

  void Finish() override {
    deferred_.SettleAll([this](DeferredFinding&& d) { Settle(std::move(d)); });
  }

 private:
  void Settle(DeferredFinding&& d) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(d.finding.slave, ReasonCode::kMissesPackets, d.finding.first.number);
      return;
    }
    if (Repeat(d.finding.slave, d.key, d.finding.first) == kNoFinding) Report(d.key, std::move(d.finding));
  }

  struct Last {
    std::uint8_t counter = 0;
    FrameNo frame = 0;
  };
  std::vector<std::array<Last, 2>> last_;
  DeferredFindings deferred_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxCounter>};

}  // namespace
}  // namespace ecaudit::mailbox_counter
