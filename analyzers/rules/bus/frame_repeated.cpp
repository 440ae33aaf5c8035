#include <algorithm>
#include <cstdint>
#include <optional>
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
    .title = "{count:number} {count?frame|frames} returned after the master had sent {count?it|them} again",
    .message =
        R"({frame} returned only in {return_frame}, after {round_trip_ms}.[ Other frames take {usual_us}.] The master
did not wait for it: after a time-out of {time_out_ms} it sent the frame again in {again_frame}.[ It accesses the mailbox of
{slave_of_mailbox}: the master may have given up the transfer.] Slaves pass a frame on within a few microseconds. So the
delay arose before or after them: in the network card, its driver or the computer of the master.)",
    .next = R"(Check the computer of the master: driver and interrupt settings, network card and load. Let the master
wait longer, or start again when a transfer fails.)"};

constexpr const FindingKind* kKinds[] = {&kAnswered, &kLate};

constexpr Word kNumbers{"frame-numbers", "a frame index that the master increments"};
constexpr Word kRound{"frames-of-a-round",
                      "whether the master sends frames again, or the capture misses a round of indices"};

constexpr RuleInfo kInfo{.id = "frame-repeated",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
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

- Slaves answered it: a working counter is above 0. A master may try again what no slave answered.
- The frame that was sent again returned, too. One that never returned belongs to frame-lost. One that returned twice
  belongs to frame-duplicated.
- A frame that only reads, and in the end brings other data, is a poll that keeps its index.
- Masters that do not number their frames send equal frames all the time. So only a late answer is decided: the master
  sent nothing for twice its usual distance of frames, then the same frame, and both returned.
- If the time-out is long enough for one round of all indices, the capture may miss that round. Then three such frames
  are reported, if the master has at least 8 indices and they show no other gap.

## Example
tests/rules/frame-repeated/violates.trace

## What to do
Look at the computer of the master, not at the slaves. Usual reasons:

- interrupt moderation of the network card, power saving, or a driver that loses frames,
- a thread without real-time priority,
- time-outs that are too short.
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
    FinishSeries();
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent()) return;
    if (may_be_gaps_ == 0) {
      if (!context().pairing().numbered) NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kNumbers);
      return;
    }
    // A gap ends at the index of the frame before it by chance, once in as many gaps as the master has indices.
    if (may_be_gaps_ >= kNoCoincidence && least_round_ >= kLeastRound && context().pairing().gaps == 0) {
      first_maybe_->count = may_be_gaps_;
      Add(std::move(*first_maybe_));
    } else {
      NotEvaluable(kNoSlave, ReasonCode::kAmbiguous, kRound, first_maybe_->first.number);
    }
  }

 private:
  /// One frame that was sent again, perhaps several times.
  struct Series {
    Finding finding;
    FrameNo newest = 0;
    std::uint32_t may_miss_round_of = 0;
    bool poll = false;
  };

  /// This number of gaps that all end at the same index is no coincidence ...
  static constexpr std::uint64_t kNoCoincidence = 3;
  /// ... where there are as many indices.
  static constexpr std::uint32_t kLeastRound = 8;

  void OnAnswered(const track::FrameRepeated& e) {
    if (!series_ || series_->newest != e.before.number) {
      FinishSeries();
      series_ = Series{FindingOf(kAnswered, e)};
      series_->finding.Set("answered_after_us", arg::Us(Elapsed(e.before.time, e.returned.time)));
      series_->finding.count = 0;
    }
    ++series_->finding.count;
    series_->finding.last = e.again;
    series_->newest = e.again.number;
    series_->may_miss_round_of = std::max(series_->may_miss_round_of, e.may_miss_round_of);
    series_->poll = series_->poll || e.brought_news;
  }

  void FinishSeries() {
    if (!series_) return;
    Series series = std::move(*series_);
    series_.reset();
    if (series.poll) return;
    if (series.may_miss_round_of == 0) {
      Add(std::move(series.finding));
      return;
    }
    may_be_gaps_ += series.finding.count;
    least_round_ = least_round_ == 0 ? series.may_miss_round_of : std::min(least_round_, series.may_miss_round_of);
    if (!first_maybe_) first_maybe_ = std::move(series.finding);
  }

  void Add(Finding finding) {
    if (answered_ == kNoFinding) {
      answered_ = Report(kAnsweredKey, std::move(finding));
      return;
    }
    Finding& first = context().store[answered_];
    first.count += finding.count;
    first.last = finding.last;
  }

  /// Each copy that returns late is one event, all of one slave's mailbox are one occasion.
  void OnLate(const track::FrameRepeated& e) {
    if (std::exchange(last_late_, e.again.number) == e.before.number) return;
    const SlaveId slave = MailboxOf(e.frame);
    const std::uint64_t key = kLateKey + (slave == kNoSlave ? 0 : std::uint64_t{slave} + 1);
    if (Repeat(kNoSlave, key, e.returned) != kNoFinding) return;
    Finding finding = FindingOf(kLate, e);
    finding.Set("round_trip_ms", arg::Ms(Elapsed(e.before.time, e.returned.time)));
    if (e.usual_ns > 0) finding.Set("usual_us", arg::Us(e.usual_ns));
    if (slave != kNoSlave) finding.Set("slave_of_mailbox", arg::Slave(slave, context().Label(slave)));
    Report(key, std::move(finding));
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
  FrameNo last_late_ = 0;  ///< the frame that was sent in place of the last one that returned late
  std::optional<Series> series_;
  FindingIndex answered_ = kNoFinding;
  std::uint64_t may_be_gaps_ = 0;       ///< frames sent again, or as many capture gaps
  std::uint32_t least_round_ = 0;       ///< of their masters' indices
  std::optional<Finding> first_maybe_;  ///< the first of them
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameRepeated>};

}  // namespace
}  // namespace ecaudit::frame_repeated
