#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_touch_probe_conflict {
namespace {

constexpr RuleInfo kInfo{.id = "latch-touch-probe-conflict",
                         .group = "Latch",
                         .severity = Severity::kWarning,
                         .title = "Latch and touch probe use the same capture unit at once",
                         .needs = "the latch control word and the touch probe function 60B8h",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether an edge of a latch is enabled in 20A4h while the touch probe of the same capture unit is enabled in 60B8h.

## Why it matters
Both set up one capture unit of the drive; the later one changes what the other waits for.

## How it is decided
Latch 1 and touch probe 1 (60B8h bit 0) use the first capture unit, latch 2 and touch probe 2 (bit 8) the second:
20A0h and 20A1h are positions of CAP0, 20A2h and 20A3h of CAP1 (MKD, 5.3.3). That the touch probes use them in the same
order is an inference. The finding names the word with which both became enabled.

## Example
tests/rules/latch-touch-probe-conflict/violates.trace

## What to do
Use either the latch words or the touch probe for one input.
)"};

class LatchTouchProbeConflict final : public LatchRule {
 public:
  LatchTouchProbeConflict() : LatchRule(kInfo, model::LatchMisuse::Kind::kTouchProbeConflict) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    const std::string number = std::to_string(misuse.edge->touch_probe);
    const std::string& unit = misuse.edge->capture_unit;
    finding.confidence = Confidence::kInferred;
    finding.title = "Touch probe " + number + " and " + EdgeText(misuse) + " are enabled at once";
    finding.message = "Since frame " + std::to_string(misuse.frame.number) + " the latch control word (" +
                      Hex(misuse.control) + ") enables " + EdgeText(misuse) + " and the touch probe function 60B8h (" +
                      Hex(misuse.value) + ") touch probe " + number + ". Both use " +
                      (unit.empty() ? "the same capture unit" : "capture unit " + unit) +
                      " of the drive, as far as the manual tells. Use one of the two.";
    finding.evidence.push_back(Text("edge", misuse.edge->name));
    finding.evidence.push_back(HexNumber("touch_probe_function", misuse.value));
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse& misuse) const override {
    return misuse.edge->touch_probe;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchTouchProbeConflict>};

}  // namespace
}  // namespace ecaudit::latch_touch_probe_conflict
