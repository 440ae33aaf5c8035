#include <array>
#include <cstdint>
#include <map>
#include <optional>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/wkc/one_buffer.h"
#include "decoder/base/time.h"

namespace ecaudit::wkc_one_buffer {
namespace {

constexpr FindingKind kNowAndThen{
    .name = "now-and-then",
    .title = "One buffer for {direction}, not [{?inputs}filled][{!inputs}emptied] in time in {missed} of {frames}",
    .message =
        R"(SM{sync_manager} ({direction}) has one buffer. So the slave counts only if its application has
[{?inputs}filled][{!inputs}emptied] it since the last datagram. In {missed} of {frames} in OP it had not: the first is
{frame}, the last {last_frame}. In all others it had.[{?no_sync0} SYNC0 is off in this slave, so nothing aligns its
application with the frames of the master.])",
    .next =
        R"([{?no_sync0}Synchronise the slave by SYNC0, and send process data at a fixed time between two of its
pulses.][{!no_sync0}Send process data at a fixed time of the cycle of the slave.] If the slave allows it, use three
buffers instead (control byte of SM{sync_manager}, bits 0 and 1).)",
    .identity = "direction"};

constexpr FindingKind kStopped{
    .name = "stopped",
    .title = "The slave no longer [{?inputs}fills][{!inputs}empties] the buffer of its {direction}",
    .message =
        R"(SM{sync_manager} ({direction}) has one buffer. So the slave counts only if its application has
[{?inputs}filled][{!inputs}emptied] it since the last datagram. Up to {last_good_frame} it had, in {counted} in
OP. From {frame} to {last_frame} it had not, in any of {missed} datagrams.)",
    .next =
        "Check why the application (processor) of the slave stopped. Read AL Status (0x0130) and its code (0x0134).",
    .identity = "direction"};

constexpr const FindingKind* kKinds[] = {&kNowAndThen, &kStopped};

constexpr RuleInfo kInfo{.id = "wkc-one-buffer",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .subject = Subject::kProcessData,
                         .title = "A slave with one buffer of process data misses datagrams",
                         .needs = "returned frames, the FMMUs and the AL states of all slaves",
                         .source = "ESC-2, sync managers: mailbox mode (one buffer)",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Sync managers of process data with one buffer: whether the slave fills (inputs) or empties (outputs) the buffer between
two datagrams.

## Why it matters
With one buffer the data are exchanged only if master and slave take turns. If each runs on its own clock, they meet now
and then. The values of that cycle are missing, and drives may report a fault of synchronisation.

## How it is decided
The working counter shows it if all slaves in the datagram are in OP, and only one of them has one buffer.

- `now-and-then`: of at least 200 datagrams at most one in 20 is missed, and at least two. Each miss counts only if a
  later datagram is exchanged again. A slave that is slower than the master misses more, which may be its way to work.
- `stopped`: at least 200 datagrams were exchanged, and from one frame on none, for at least 1 s and 20 datagrams.

Both are inferred: the working counter is a sum.

## Example
tests/rules/wkc-one-buffer/violates.trace: a drive whose cycle drifts against that of the master.

## What to do
Synchronise the slave and the master, or use three buffers. If the slave stopped, look for the reason there.
)"};

constexpr std::uint64_t kLeastDatagrams = 200;
constexpr std::uint64_t kLeastMissed = 2;
constexpr std::uint64_t kOneIn = 20;
constexpr std::uint64_t kLeastInARow = 20;
constexpr TimeNs kLongStop = 1'000'000'000;

class WkcOneBuffer final : public Rule {
 public:
  WkcOneBuffer() : Rule(kInfo) { Subscribe<track::LogicalAccess>(&WkcOneBuffer::On); }

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen()) return;
    const auto use = wkc::UseOfOneBuffer(context(), e);
    if (!use) return;
    auto& ways = slaves_[use->slave];
    for (std::size_t way = 0; way < ways.size(); ++way) {
      if (use->ways[way].manager) ways[way].Add(use->ways[way], e.returned);
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [slave, ways] : slaves_) {
      for (std::size_t way = 0; way < ways.size(); ++way) Evaluate(slave, ways[way], way == 1);
    }
  }

 private:
  /// Datagrams without the slave.
  struct Missed {
    std::uint64_t count = 0;
    FrameRef first, last;

    void Add(const FrameRef& frame) {
      if (count++ == 0) first = frame;
      last = frame;
    }
    void Add(const Missed& later) {
      if (later.count == 0) return;
      if (count == 0) first = later.first;
      count += later.count;
      last = later.last;
    }
  };
  struct Buffer {
    std::uint8_t manager = 0;
    std::uint64_t counted = 0;
    FrameRef last_counted;
    Missed between;   ///< two that counted
    Missed in_a_row;  ///< since the last one that counted

    void Add(const wkc::OneBufferUse::Way& way, const FrameRef& frame) {
      manager = *way.manager;
      if (!way.counted) {
        if (counted > 0) in_a_row.Add(frame);
        return;
      }
      ++counted;
      last_counted = frame;
      between.Add(in_a_row);
      in_a_row = {};
    }
  };

  void Evaluate(SlaveId slave, const Buffer& buffer, bool inputs) {
    if (Stopped(buffer)) {
      Finding finding = Make(kStopped, slave, buffer, buffer.in_a_row, inputs);
      finding.Set("last_good_frame", arg::Frame(buffer.last_counted.number))
          .Set("counted", arg::Count(buffer.counted, "datagram"));
      AddRelated(finding, buffer.last_counted.number);
      (void)Report(inputs ? 1 : 0, std::move(finding));
      return;
    }
    const Missed& missed = buffer.between;
    const std::uint64_t all = buffer.counted + missed.count;
    if (all < kLeastDatagrams || missed.count < kLeastMissed || missed.count * kOneIn > all) return;
    Finding finding = Make(kNowAndThen, slave, buffer, missed, inputs);
    finding.count = missed.count;
    finding.Set("frames", arg::Count(all, "datagram"));
    if (wkc::IsSync0Off(context(), slave)) finding.Set("no_sync0", arg::Flag());
    (void)Report(2 + (inputs ? 1U : 0U), std::move(finding));
  }

  [[nodiscard]] Finding Make(const FindingKind& kind, SlaveId slave, const Buffer& buffer, const Missed& missed,
                             bool inputs) {
    Finding finding = Found(kind, slave, missed.first);
    finding.confidence = Confidence::kInferred;
    finding.last = missed.last;
    finding.Set("inputs", arg::Flag(inputs))
        .Set("direction", arg::Of(inputs ? kInputs : kOutputs))
        .Set("sync_manager", arg::Number(buffer.manager))
        .Set("missed", arg::Number(static_cast<std::int64_t>(missed.count)))
        .Set("last_frame", arg::Frame(missed.last.number));
    return finding;
  }

  [[nodiscard]] static bool Stopped(const Buffer& buffer) {
    const Missed& row = buffer.in_a_row;
    if (buffer.counted < kLeastDatagrams || row.count < kLeastInARow) return false;
    return row.first.has_time && row.last.has_time && Elapsed(row.first.time, row.last.time) >= kLongStop;
  }

  static constexpr Word kOutputs{"outputs", "outputs", true};
  static constexpr Word kInputs{"inputs", "inputs", true};
  std::map<SlaveId, std::array<Buffer, 2>> slaves_;  ///< outputs, inputs
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcOneBuffer>};

}  // namespace
}  // namespace ecaudit::wkc_one_buffer
