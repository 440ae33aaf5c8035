#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_invalid_selector {
namespace {

constexpr RuleInfo kInfo{.id = "latch-invalid-selector",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "The read selector of the latch control word is none that the drive has",
                         .needs = "the latch control word as the drive took it",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether the read selector (20A4h, bits 8 to 12) is 0 or one that the family defines: 1 to 4, for Pilz 1 to 5.

## Why it matters
The drive has no position to supply; its answer means nothing.

## How it is decided
Each time the selector changes to a value that the family's manual does not list. Different values of one slave are
one finding that counts them.

## Example
samples/captures/latch-misuse.pcapng

## What to do
Correct the selector: 1 and 2 read latch 1 (rising, falling), 3 and 4 latch 2, 5 the internal latch C of Pilz drives.
)"};

class LatchInvalidSelector final : public LatchRule {
 public:
  LatchInvalidSelector() : LatchRule(kInfo, model::LatchMisuse::Kind::kInvalidSelector) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    const device::LatchDescription& latch = *context().slave(misuse.slave).profile->latch;
    std::string defined;
    for (const device::LatchEdge& edge : latch.edges) {
      defined += (defined.empty() ? "" : ", ") + std::to_string(edge.selector) + " (" + edge.name + ")";
    }
    finding.title = "Read selector " + std::to_string(misuse.value) + " does not exist";
    finding.message = "The master set read selector " + std::to_string(misuse.value) + " in the latch control word (" +
                      Hex(misuse.control) + ") " + FrameText(misuse) + ". The manual defines " + defined +
                      ". Use one of these, or 0.";
    finding.evidence.push_back(Number("selector", misuse.value));
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse&) const override { return 0; }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchInvalidSelector>};

}  // namespace
}  // namespace ecaudit::latch_invalid_selector
