#include <cstdint>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/time.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"
#include "decoder/track/mailbox_window.h"
#include "decoder/track/network.h"

namespace ecaudit::frame_repeated {
namespace {

constexpr FindingKind kAnswered{
    .name = "answered",
    .title = "{count:number} {count?frame|frames} sent again although {count?it was|they were} answered",
    .message =
        R"({frame} returned in {return_frame}, after {answered_after_us}. All the same, the master sent it again in
{again_frame}, after {time_out_ms}. So the answer did not reach the program of the master: the network card, its driver or
the computer loses it.)",
    .next = R"(Check the computer of the master: driver and settings of the network card, load, and other programs that
use the card.)"};

constexpr FindingKind kLate{
    .name = "late",
    .title = "A frame came back {late_ms} late, after the master had sent it again",
    .message =
        R"({frame} came back only in {return_frame}, after {round_trip_ms}.[ Other frames take {usual_us}.] The master
had not waited for it: it sent the frame again in {again_frame}, after {time_out_ms}.[ It accesses the mailbox of {slave_of_mailbox}:
the master may have given up the transfer.] Slaves pass a frame on within a few
microseconds. So it was held up before or after them: in the network card, its driver or the computer of the master.)",
    .next = R"(Check the computer of the master: driver and interrupt settings of the network card, load. Let the master
wait longer, or start again when a transfer fails.)"};

constexpr const FindingKind* kKinds[] = {&kAnswered, &kLate};

constexpr Word kNumbers{"frame-numbers", "whether the master sends frames again (it does not number them)"};

constexpr RuleInfo kInfo{.id = "frame-repeated",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .title = "The master sends a frame again although its answer comes back",
                         .needs = "outbound and returned frames of a master that numbers its frames, and time stamps",
                         .source = "ESC-1, frame processing: a frame returns after the delay of the line",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
- Frames that returned, and that the master sent again after a time-out all the same.
- Frames that returned so late that the master had already sent them again.

## Why it matters
Slaves and cables worked: the answer is in the capture. What failed is the way between the line and the program of the
master: network card, driver, interrupts, load. The master assumes that a slave did not answer. What it does next (a
transfer given up, a setting left out, a slave reported as missing) looks like a fault of the slave.

## How it is decided
By content. The frame that is sent again is byte for byte the one that the same master sent before, with the same index.
Its time-out is longer than frames take, and at most 100 ms.

- Masters that do not number their frames send equal frames all the time: nothing can be decided.
- A frame that never returned belongs to frame-lost. One that returned twice belongs to frame-duplicated.

## Example
tests/rules/frame-repeated/violates.trace

## What to do
Look at the computer of the master, not at the slaves. Usual reasons are interrupt moderation of the network card, power
saving, a driver that loses frames, a thread without real-time priority, and time-outs that are too short.
)"};

class FrameRepeated final : public Rule {
 public:
  FrameRepeated() : Rule(kInfo) { Subscribe<track::FrameRepeated>(&FrameRepeated::On); }

  void On(const track::FrameRepeated& e) {
    if (e.answered()) {
      OnAnswered(e);
    } else {
      OnLate(e);
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent()) return;
    if (!context().pairing().numbered) NotEvaluable(kNoSlave, ReasonCode::kAmbiguous, kNumbers);
  }

 private:
  void OnAnswered(const track::FrameRepeated& e) {
    if (Repeat(kNoSlave, kAnsweredKey, e.again) != kNoFinding) return;
    Finding finding = FindingOf(kAnswered, e);
    finding.Set("answered_after_us", arg::Us(Elapsed(e.before.time, e.returned.time)));
    Report(kAnsweredKey, std::move(finding));
  }

  /// Each copy that comes back late is one event, all of them are one occasion.
  void OnLate(const track::FrameRepeated& e) {
    if (std::exchange(last_late_, e.again.number) == e.before.number) return;
    if (Repeat(kNoSlave, kLateKey, e.returned) != kNoFinding) return;
    const TimeNs round_trip = Elapsed(e.before.time, e.returned.time);
    Finding finding = FindingOf(kLate, e);
    finding.Set("round_trip_ms", arg::Ms(round_trip)).Set("late_ms", arg::Ms(round_trip - e.usual_ns));
    if (e.usual_ns > 0) finding.Set("usual_us", arg::Us(e.usual_ns));
    if (const SlaveId slave = MailboxOf(e.frame); slave != kNoSlave) {
      finding.Set("slave_of_mailbox", arg::Slave(slave, context().Label(slave)));
    }
    Report(kLateKey, std::move(finding));
  }

  /// The slave whose mailbox the frame writes or reads; kNoSlave: none.
  [[nodiscard]] SlaveId MailboxOf(const wire::FrameView& frame) const {
    const track::Network& network = context().network();
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const wire::DatagramView d = frame[i];
      if (!wire::IsNodeAddressed(d.command())) continue;
      const SlaveId slave = network.slaves().AtStation(d.adp());
      if (slave == kNoSlave) continue;
      const track::MailboxWindow window = track::MailboxWindowOf(network.state(slave));
      const auto within = [&](EscAddress start, std::uint16_t length) {
        return d.ado() >= start && d.ado() - start < length;
      };
      if (within(window.out_start, window.out_length) || within(window.in_start, window.in_length)) return slave;
    }
    return kNoSlave;
  }

  static Finding FindingOf(const FindingKind& kind, const track::FrameRepeated& e) {
    Finding finding = Found(kind, kNoSlave, e.before);
    finding.confidence = Confidence::kInferred;
    AddRelated(finding, e.again.number);
    AddRelated(finding, e.returned.number);
    finding.Set("return_frame", arg::Frame(e.returned.number))
        .Set("again_frame", arg::Frame(e.again.number))
        .Set("time_out_ms", arg::Ms(Elapsed(e.before.time, e.again.time)));
    return finding;
  }

  static constexpr std::uint64_t kAnsweredKey = 1;
  static constexpr std::uint64_t kLateKey = 2;
  FrameNo last_late_ = 0;  ///< the frame that was sent in place of the last one that came back late
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameRepeated>};

}  // namespace
}  // namespace ecaudit::frame_repeated
