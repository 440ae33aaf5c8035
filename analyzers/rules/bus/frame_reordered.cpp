#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"

namespace ecaudit::frame_reordered {
namespace {

constexpr RuleInfo kInfo{.id = "frame-reordered",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .title = "Frames stand in another order than they were sent",
                         .needs = "outbound and returned frames",
                         .source = "ESC-1, frame processing",
                         .doc = R"(
## What it checks
Whether returned frames stand in the order in which the same master sent them.

## Why it matters
On one line no frame overtakes another. Where the order differs, the recorder mixed up its queues or interfaces, a
network card sorts frames into several queues, or a switch stands between master and slaves. What the slaves did first
is then not certain, and a master that expects its frames in order takes them for lost.

## How it is decided
A frame that comes back behind one that its master sent later. Where a frame of the same commands and addresses that
was sent later is still under way, what came back may be that one's, and nothing is said. Nor is it where the master may
have sent such a frame once more since, and the capture misses that: its index is used again soon. Frames that never
come back are frame-lost. Not evaluable where one direction is missing, or the capture misses so many packets that a
frame may have been taken for another.

## Example
tests/rules/frame-reordered/violates.trace

## What to do
Record with one queue and one clock (hardware stamps of one card, or a probe), sort the capture by its stamps, and
connect the master to the slaves directly.
)"};

class FrameReordered final : public Rule {
 public:
  FrameReordered() : Rule(kInfo) {}

  void Finish() override {
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent()) return;
    const bus::PairingStatistics& pairing = context().pairing();
    if (pairing.first_in_doubt.seen()) {
      NotEvaluable(
          kNoSlave,
          "a frame came back so late that its index may have been used again meanwhile: this may be the return of a "
          "frame that the capture misses",
          pairing.first_in_doubt.number);
    }
    if (pairing.reordered == 0) return;
    if (MissesPackets(pairing)) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, pairing.first_reordered.number);
      return;
    }
    Finding finding;
    finding.first = pairing.first_reordered;
    finding.last = pairing.last_reordered;
    finding.count = pairing.reordered;
    finding.title = Count(pairing.reordered, "frame") + " came back behind frames that were sent later";
    finding.message = "Frame " + std::to_string(finding.first.number) +
                      " is the returned copy of a frame behind which others were sent that came back before it. On one "
                      "line no frame overtakes another: the recorder mixed up its queues or interfaces, the network "
                      "card has several queues, or a switch stands between master and slaves. Sort the capture by its "
                      "stamps, or record with one queue.";
    finding.evidence.push_back(Number("reordered_frames", static_cast<std::int64_t>(pairing.reordered)));
    (void)Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameReordered>};

}  // namespace
}  // namespace ecaudit::frame_reordered
