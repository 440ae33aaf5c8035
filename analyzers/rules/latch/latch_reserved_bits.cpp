#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_reserved_bits {
namespace {

constexpr RuleInfo kInfo{.id = "latch-reserved-bits",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "Reserved bits of the latch control word are set",
                         .needs = "the latch control word as the drive took it",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether bits of the latch control word (20A4h) are set that the family's manual reserves: 4 to 7 and 13 to 15, for
Pilz 5 to 7 and 13 to 15.

## Why it matters
What the drive does with them is not defined. Often the word is built for another family, or lies in the wrong place.

## How it is decided
Each time such a bit is set that was not set in the control word before. All of one slave are one finding that counts
them and names the words.

## Example
tests/rules/latch-reserved-bits/violates.trace

## What to do
Keep these bits 0. If the values look random, compare the PDO mapping with what the master fills in.
)"};

class LatchReservedBits final : public LatchRule {
 public:
  LatchReservedBits() : LatchRule(kInfo, model::LatchMisuse::Kind::kReservedBits) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    const device::LatchDescription& latch = *context().slave(misuse.slave).profile->latch;
    finding.title = "Reserved bits " + Hex(misuse.value) + " of the latch control word set";
    finding.message = "The latch control word is " + Hex(misuse.control) + " " + FrameText(misuse) +
                      "; the manual reserves the bits " + Hex(latch.reserved_control) + ", of which " +
                      Hex(misuse.value) + " became set. Keep them 0.";
    finding.evidence.push_back(HexNumber("reserved_bits_set", misuse.value));
    finding.evidence.push_back(HexNumber("reserved_bits", latch.reserved_control));
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse&) const override { return 0; }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchReservedBits>};

}  // namespace
}  // namespace ecaudit::latch_reserved_bits
