#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_read_before_valid {
namespace {

constexpr RuleInfo kInfo{.id = "latch-read-before-valid",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .title = "A latched position is asked for before its valid bit is set",
                         .needs = "the latch control word and the status word before it",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether the valid bit of an edge (status word 20A5h) is set when its read selector (control word 20A4h, bits 8 to 12) is
set.

## Why it matters
There is no new position to read: what the drive supplies is an old value or none, and the master takes it for the
position of the edge it waits for.

## How it is decided
When the selector changes to an edge of the family, the last status word before it must show the valid bit. The
status word in the same frame is older than the control word and counts as well. Where inputs are missing just before,
or no status word was seen, the rule is not evaluable. One occasion for each time the selector is set.

## Example
samples/captures/latch-misuse.pcapng

## What to do
Set the selector only after the status word shows the valid bit of the same edge.
)"};

class LatchReadBeforeValid final : public LatchRule {
 public:
  LatchReadBeforeValid() : LatchRule(kInfo, model::LatchMisuse::Kind::kReadBeforeValid) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    finding.title =
        "Read selector " + std::to_string(misuse.value) + " set although " + EdgeText(misuse) + " is not valid";
    finding.message = "The master set read selector " + std::to_string(misuse.value) + " (" + EdgeText(misuse) + ") " +
                      FrameText(misuse) + ", but the status word does not show the valid bit " +
                      Hex(misuse.edge->valid) + CaptureText(misuse.capture) +
                      ". By the manual the position is there once that bit is set. Wait for it before reading.";
    finding.evidence.push_back(Text("edge", misuse.edge->name));
    finding.evidence.push_back(Number("selector", misuse.value));
    finding.evidence.push_back(HexNumber("valid_bit", misuse.edge->valid));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchReadBeforeValid>};

}  // namespace
}  // namespace ecaudit::latch_read_before_valid
