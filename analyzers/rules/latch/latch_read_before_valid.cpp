#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_read_before_valid {
namespace {

constexpr FindingKind kNotValid{
    .name = "not-valid",
    .title = "Read selector {selector} set although {edge} is not valid",
    .message =
        R"(The master set read selector {selector} ({edge})[{?by_sdo} by SDO] in {frame}. The status word before it
does not show the valid bit ({valid_bit}).[ The edge was armed in {armed_frame}.][ It became valid in {valid_frame}.]
By the manual the position is available when that bit is set.)",
    .next = "Wait for the valid bit before setting the selector.",
    .identity = "edge selector"};

constexpr const FindingKind* kKinds[] = {&kNotValid};

constexpr RuleInfo kInfo{.id = "latch-read-before-valid",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "The master requests a latched position before its valid bit is set",
                         .needs = "the latch control word and the status word before it",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether the valid bit of an edge (status word 20A5h) is set when its read selector (control word 20A4h, bits 8 to 12) is
set.

## Why it matters
There is no new position to read. The drive supplies an old value or none, and the master uses it as the position of
the edge for which it waits.

## How it is decided
When the selector changes to an edge of the family, the last status word before it must show the valid bit. The status
word in the same frame is older than the control word and counts as well. One occasion for each time the selector is
set.

The rule is not evaluated if inputs are missing just before, or if no status word was seen.

## Example
samples/captures/latch-misuse.pcapng

## What to do
Set the selector only after the status word shows the valid bit of the same edge.
)"};

class LatchReadBeforeValid final : public LatchRule {
 public:
  LatchReadBeforeValid() : LatchRule(kInfo, model::LatchMisuse::Kind::kReadBeforeValid) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    Finding finding = Found(kNotValid, misuse.slave, misuse.frame);
    SetCapture(finding, misuse);
    finding.Set("selector", arg::Number(misuse.value)).Set("valid_bit", arg::Hex(misuse.edge->valid));
    return finding;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchReadBeforeValid>};

}  // namespace
}  // namespace ecaudit::latch_read_before_valid
