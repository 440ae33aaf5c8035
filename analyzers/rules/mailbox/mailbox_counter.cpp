#include <array>
#include <vector>

#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::mailbox_counter {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-counter",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .title = "The mailbox counter does not advance through 1 to 7",
                         .needs = "two messages in the same direction with no gap between them",
                         .source = "ETG1000.4, mailbox; ESC-1, mailbox",
                         .doc = R"(
## What it checks
The counter in byte 5 of each mailbox message against that of the message before it in the same direction: 1 to 7, then
1 again.

## Why it matters
The receiver tells a repetition from a new message by the counter. A slave drops a request whose counter it has just
seen, and the master then waits for an answer that never comes; a skipped number means that a message got lost.

## How it is decided
Counter 0 means that the sender does not count (IgH and TwinCAT requests): not judged. Not judged either: the first
message after a start, a gap or a lost frame; a request repeated with its counter; the answer to a repeat request; and
slaves that answer with the counter of the request. What the vendor manuals print about these bits ("reserved") is an
error of theirs: their drives count as the standard says.

## Example
samples/captures/mailbox-counter.pcapng: the answer in frame 148 has counter 3 after 1.

## What to do
In the master: one counter for all protocols of a slave, started again at 1 after INIT. In a slave: one counter for all
that it sends, emergencies included.
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
    Finding finding;
    finding.slave = m.slave;
    finding.first = m.frame();
    finding.confidence = ConfidenceOf(m.window_inferred ? Certainty::kInferred : Certainty::kObserved);
    finding.title = "Mailbox counter " + std::to_string(m.header.counter) + " " + WhichWay(m.direction) + " after " +
                    std::to_string(before.counter) + ", " + std::to_string(expected) + " expected";
    finding.message = "The " + Name(m.header.protocol) + " message " + WhichWay(m.direction) + " in frame " +
                      std::to_string(m.frame().number) + " has counter " + std::to_string(m.header.counter) +
                      "; the one before it, in frame " + std::to_string(before.frame) + ", had " +
                      std::to_string(before.counter) + ", so " + std::to_string(expected) + " has to follow. ";
    if (m.direction == mailbox::Direction::kOut) {
      finding.message +=
          same ? "A slave takes a request with the counter of the last one for a repetition and drops it: "
                 "the master has to count on."
               : "The master skipped numbers: a message was lost on its way, or the master counts "
                 "wrong.";
    } else {
      finding.message += same ? "A master may take it for a repetition and drop it: the slave has to count on."
                              : "A message of the slave was lost, or the slave counts wrong (some number emergencies "
                                "by themselves).";
    }
    finding.evidence.push_back(Text("direction", std::string(Name(m.direction))));
    finding.evidence.push_back(Number("counter", m.header.counter));
    finding.evidence.push_back(Number("expected", expected));
    finding.evidence.push_back(Number("before", before.counter));
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
