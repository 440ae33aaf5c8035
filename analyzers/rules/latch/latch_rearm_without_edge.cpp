#include <cctype>

#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_rearm_without_edge {
namespace {

constexpr RuleInfo kInfo{.id = "latch-rearm-without-edge",
                         .group = "Latch",
                         .severity = Severity::kWarning,
                         .title = "A new capture is awaited although the latch was never armed again",
                         .needs = "latch control and status words",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether the enable bit of an edge returns to 0 between two readings of its position.

## Why it matters
The drive captures once for each rising edge of the enable bit. While the bit stays set, the next edge of the input
changes nothing, and the master reads the old position again.

## How it is decided
A position was read by its selector and acknowledged; the selector went back to 0 while the enable bit stayed set; and
then the same selector is set again, with the valid bit set all along. A drive that takes its valid bit back and sets it
again armed itself; that is no finding. Where a control word in between may have cleared the enable bit (its frame was
lost), the rule is not evaluable.

## Example
tests/rules/latch-rearm-without-edge/violates.trace

## What to do
Clear the enable bit after each reading, and set it again to arm the latch.
)"};

class LatchRearmWithoutEdge final : public LatchRule {
 public:
  LatchRearmWithoutEdge() : LatchRule(kInfo, model::LatchMisuse::Kind::kRearmWithoutEdge) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    finding.title = EdgeText(misuse) + " read again without being armed anew";
    finding.title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(finding.title[0])));
    finding.message =
        "The position of " + EdgeText(misuse) + CaptureText(misuse.capture) + " was acknowledged in frame " +
        std::to_string(misuse.capture.acknowledged.number) + ". The master set the same selector again " +
        FrameText(misuse) + ", but the enable bit " + Hex(misuse.edge->enable) +
        " never returned to 0 in between: the drive still holds the old capture. Clear the enable bit and "
        "set it again to arm the latch.";
    finding.evidence.push_back(Text("edge", misuse.edge->name));
    finding.evidence.push_back(Number("selector", misuse.value));
    finding.evidence.push_back(HexNumber("enable_bit", misuse.edge->enable));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchRearmWithoutEdge>};

}  // namespace
}  // namespace ecaudit::latch_rearm_without_edge
