#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_touch_probe_conflict {
namespace {

constexpr FindingKind kEnabledTogether{
    .name = "enabled-together",
    .title = "Touch probe {touch_probe} and {edge} are enabled together",
    .message = R"(Since {frame} the latch control word ({control_word}) enables {edge}. At the same time the touch
probe function 60B8h ({touch_probe_function}) enables touch probe {touch_probe}. As far as the manual shows, both use
[capture unit {capture_unit}][{!capture_unit}the same capture unit] of the drive.)",
    .next = "Use only one of the two for this input.",
    .identity = "touch_probe edge"};

constexpr const FindingKind* kKinds[] = {&kEnabledTogether};

constexpr RuleInfo kInfo{.id = "latch-touch-probe-conflict",
                         .group = "Latch",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "Latch and touch probe use the same capture unit at the same time",
                         .needs = "the latch control word and the touch probe function 60B8h",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether an edge of a latch is enabled in 20A4h while the touch probe of the same capture unit is enabled in 60B8h.

## Why it matters
Both configure one capture unit of the drive. The later one changes the edge for which the other waits.

## How it is decided
Latch 1 and touch probe 1 (60B8h bit 0) use the first capture unit, latch 2 and touch probe 2 (bit 8) the second. 20A0h
and 20A1h are positions of CAP0, 20A2h and 20A3h of CAP1 (MKD, 5.3.3). That the touch probes use them in the same order
is an inference. The finding cites the word with which both became enabled.

## Example
tests/rules/latch-touch-probe-conflict/violates.trace

## What to do
Use either the latch words or the touch probe for one input.
)"};

class LatchTouchProbeConflict final : public LatchRule {
 public:
  LatchTouchProbeConflict() : LatchRule(kInfo, model::LatchMisuse::Kind::kTouchProbeConflict) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    Finding finding = Found(kEnabledTogether, misuse.slave, misuse.frame);
    finding.confidence = Confidence::kInferred;
    finding.Set("edge", arg::Text(misuse.edge->name))
        .Set("touch_probe_function", arg::Hex(misuse.value))
        .Set("touch_probe", arg::Number(misuse.edge->touch_probe));
    const std::string& unit = misuse.edge->capture_unit;
    if (!unit.empty()) finding.Set("capture_unit", arg::Text(unit));
    return finding;
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse& misuse) const override {
    return misuse.edge->touch_probe;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchTouchProbeConflict>};

}  // namespace
}  // namespace ecaudit::latch_touch_probe_conflict
