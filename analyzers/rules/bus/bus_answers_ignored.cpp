#include <algorithm>
#include <cstdint>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/time.h"
#include "decoder/bus/direction.h"
#include "decoder/pipeline.h"

namespace ecaudit::bus_answers_ignored {
namespace {

/// A master that finds slaves goes on within milliseconds.
constexpr std::int64_t kLongEnoughNs = 100'000'000;
/// So often it has to look for slaves, and slaves have to answer.
constexpr std::uint64_t kAttempts = 2;
/// ESC type: what masters read of all slaves to count them.
constexpr EscAddress kEscType = 0x0000;

constexpr FindingKind kIgnored{
    .name = "ignored",
    .title = "{slaves} {slaves?answers|answer}, but the master addresses none",
    .message =
        R"(The master looked for slaves {attempts}, from {frame} to {last_frame} (broadcast read of 0x0000). {slaves}
{slaves?counts|count} in {answered_frame}. All the same, the master wrote only to all slaves at once and addressed none of
them. So it probably did not receive the answers. Its receive path may return its own frames to it, with working counter 0.)",
    .next = R"(Check the receive path of the master. The driver must return received frames, not those that it sends:
check loopback, filters and the selected network card.)"};
constexpr const FindingKind* kKinds[] = {&kIgnored};

constexpr RuleInfo kInfo{.id = "bus-answers-ignored",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .title = "Slaves answer, but the master acts as if there were none",
                         .needs = "both directions of a start-up: broadcast writes, and broadcast reads of 0x0000",
                         .source = "ETG1000.4, frame processing: each slave that takes part counts",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether a master that counts the slaves goes on to address them.

## Why it matters
The bus works and the slaves answer, but the program reports "no slaves found". The fault is in the computer of the
master, between its network card and the program. Replacing cables or slaves does not help.

## How it is decided
- The master wrote to all slaves (0x0120 or another register of the set-up) and read 0x0000 of all of them, at least
  twice within at least 100 ms.
- Slaves counted these reads.
- The master sent nothing to a position, a station address or a logical address, in the whole capture.
- A master that only reads by broadcast does not set up the bus and is not reported.

## Example
tests/rules/bus-answers-ignored/violates.trace

## What to do
Send one frame and look at what the program receives: working counter 0 and the bytes as sent are its own frame.
)"};

class BusAnswersIgnored final : public Rule {
 public:
  BusAnswersIgnored() : Rule(kInfo) { Subscribe<FrameSeen>(&BusAnswersIgnored::On); }

  void On(const FrameSeen& e) {
    if (addresses_ || e.frame.empty()) return;  // nearly always
    const bool outbound = e.direction == bus::Direction::kOutbound;
    if (!outbound && e.direction != bus::Direction::kReturned) return;
    for (std::size_t i = 0; i < e.frame.size(); ++i) {
      const wire::DatagramView d = e.frame[i];
      if (d.command() != wire::Command::NOP && !wire::IsBroadcast(d.command())) {
        addresses_ = true;
        return;
      }
      if (outbound && d.command() == wire::Command::BWR) wrote_ = true;
      if (d.command() != wire::Command::BRD || d.ado() != kEscType) continue;
      if (outbound) {
        // A time-out repeats the frame: that is the same attempt.
        if (d.index() == index_ && attempts_ > 0) continue;
        index_ = d.index();
        if (attempts_++ == 0) first_ = e.frame.ref();
        last_ = e.frame.ref();
      } else if (d.wkc() > 0) {
        if (answered_++ == 0) first_answer_ = e.frame.ref();
        slaves_ = std::max(slaves_, d.wkc());
      }
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent()) return;
    if (addresses_ || !wrote_ || attempts_ < kAttempts || answered_ < kAttempts) return;
    if (!first_.has_time || !last_.has_time || Elapsed(first_.time, last_.time) < kLongEnoughNs) return;
    Finding finding = Found(kIgnored, kNoSlave, first_);
    finding.confidence = Confidence::kInferred;
    finding.last = last_;
    finding.Set("slaves", arg::Count(slaves_, "slave"))
        .Set("attempts", arg::Count(attempts_, "time"))
        .Set("answered_frame", arg::Frame(first_answer_.number));
    AddRelated(finding, first_answer_.number);
    Report(0, std::move(finding));
  }

 private:
  bool addresses_ = false;  ///< the master sends to slaves, not only to all of them
  bool wrote_ = false;
  std::uint8_t index_ = 0;
  std::uint16_t slaves_ = 0;
  std::uint64_t attempts_ = 0, answered_ = 0;
  FrameRef first_, last_, first_answer_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusAnswersIgnored>};

}  // namespace
}  // namespace ecaudit::bus_answers_ignored
