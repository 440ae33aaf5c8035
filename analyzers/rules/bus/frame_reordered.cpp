#include <utility>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"

namespace ecaudit::frame_reordered {
namespace {

constexpr FindingKind kReordered{
    .name = "reordered",
    .title = "{reordered_frames} returned after frames that were sent later",
    .message = R"({frame} returned after frames that the same master sent later. On one line no frame overtakes another.
So the recorder mixed up its queues or interfaces, the network card has several queues, or a switch is between master and
slaves.)",
    .next =
        "[{?stamps_in_order}The time stamps are in the captured order, so sorting does not help. Use one receive queue "
        "in the network card of the master, and connect the slaves without a switch.][{!stamps_in_order}Sort the "
        "capture by its time stamps, or record with one queue.]"};
constexpr const FindingKind* kKinds[] = {&kReordered};

constexpr Word kLateReturn{"late-return", "a late return"};

constexpr RuleInfo kInfo{.id = "frame-reordered",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "Frames are captured in another order than they were sent",
                         .needs = "outbound and returned frames",
                         .source = "ESC-1, frame processing",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether returned frames are captured in the order in which the same master sent them.

## Why it matters
On one line no frame overtakes another. If the order differs, the recorder mixed up its queues or interfaces, a network
card sorts frames into several queues, or a switch is between master and slaves. The order in which the slaves processed
the frames is then uncertain. A master that expects its frames in order takes them for lost.

## How it is decided
A frame that returns after one that its master sent later.

- A later frame with the same commands and addresses may still be in flight. Then the return may belong to that frame,
  and nothing is reported.
- The capture may miss that the master sent such a frame again. Then its index is used again soon, and nothing is
  reported.
- Frames that never return belong to frame-lost.
- The rule is not evaluable if one direction is missing, or if the capture misses packets so that one frame may
  have been taken for another.

## Example
tests/rules/frame-reordered/violates.trace

## What to do
Record with one queue and one clock (hardware stamps of one card, or a probe), and connect the master to the slaves
directly. Sort the capture by its stamps if stamps go back in it.
)"};

class FrameReordered final : public Rule {
 public:
  FrameReordered() : Rule(kInfo) {}

  void Finish() override {
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent()) return;
    const bus::PairingStatistics& pairing = context().pairing();
    if (pairing.first_in_doubt.seen()) {
      NotEvaluable(kNoSlave, ReasonCode::kAmbiguous, kLateReturn, pairing.first_in_doubt.number);
    }
    if (pairing.reordered == 0) return;
    if (MissesPackets(pairing)) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, pairing.first_reordered.number);
      return;
    }
    Finding finding = Found(kReordered, kNoSlave, pairing.first_reordered);
    finding.last = pairing.last_reordered;
    finding.count = pairing.reordered;
    finding.Set("reordered_frames", arg::Count(pairing.reordered, "frame"));
    if (pairing.first_reordered.has_time && context().statistics().backwards == 0) {
      finding.Set("stamps_in_order", arg::Flag());
    }
    (void)Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameReordered>};

}  // namespace
}  // namespace ecaudit::frame_reordered
