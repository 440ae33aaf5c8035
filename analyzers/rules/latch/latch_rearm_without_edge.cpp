#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_rearm_without_edge {
namespace {

constexpr FindingKind kNotRearmed{
    .name = "not-rearmed",
    .title = "Position of {edge} read twice without re-arming",
    .message = R"(The drive acknowledged the read of {edge} in {acknowledge_frame}.[ The edge was armed in
{armed_frame}.][ It became valid in {valid_frame}.] The master set the same selector again[{?by_sdo} by SDO] in
{frame}. The enable bit ({enable_bit}) did not return to 0 in between, so the drive still holds the old position.)",
    .next = "Clear the enable bit after each read, and set it again to arm the latch.",
    .identity = "edge"};

constexpr const FindingKind* kKinds[] = {&kNotRearmed};

constexpr RuleInfo kInfo{.id = "latch-rearm-without-edge",
                         .group = "Latch",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "The master reads a latch again without re-arming it",
                         .needs = "latch control and status words",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether the enable bit of an edge returns to 0 between two reads of its position.

## Why it matters
The drive captures once for each rising edge of the enable bit. While the bit stays set, the next edge of the input
changes nothing, and the master reads the old position again.

## How it is decided
- The position was read by its selector and acknowledged.
- The selector returned to 0 while the enable bit stayed set.
- The same selector is set again, with the valid bit set all along.

If the drive clears its valid bit and sets it again, it armed itself. That is no finding. The rule is not evaluated if a
control word in between may have cleared the enable bit (its frame was lost).

## Example
tests/rules/latch-rearm-without-edge/violates.trace

## What to do
Clear the enable bit after each read, and set it again to arm the latch.
)"};

class LatchRearmWithoutEdge final : public LatchRule {
 public:
  LatchRearmWithoutEdge() : LatchRule(kInfo, model::LatchMisuse::Kind::kRearmWithoutEdge) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    Finding finding = Found(kNotRearmed, misuse.slave, misuse.frame);
    SetCapture(finding, misuse);
    finding.Set("selector", arg::Number(misuse.value))
        .Set("enable_bit", arg::Hex(misuse.edge->enable))
        .Set("acknowledge_frame", arg::Frame(misuse.capture.acknowledged.number));
    return finding;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchRearmWithoutEdge>};

}  // namespace
}  // namespace ecaudit::latch_rearm_without_edge
