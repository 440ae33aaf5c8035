#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit::latch_reserved_bits {
namespace {

constexpr FindingKind kReservedBitsSet{
    .name = "reserved-bits-set",
    .title = "Reserved bits {reserved_bits_set} of the latch control word set",
    .message = R"(The latch control word is {control_word} in {frame}[{?by_sdo} (by SDO)]. The manual reserves the
bits {reserved_bits}. Of these the master set {reserved_bits_set}.)",
    .next = "Keep these bits 0.",
    .identity = "reserved_bits_set"};

constexpr const FindingKind* kKinds[] = {&kReservedBitsSet};

constexpr RuleInfo kInfo{.id = "latch-reserved-bits",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "Reserved bits of the latch control word are set",
                         .needs = "the latch control word that the drive accepted",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether bits of the latch control word (20A4h) are set that the manual of the family reserves: 4 to 7 and 13 to 15, for
Pilz 5 to 7 and 13 to 15.

## Why it matters
The effect of these bits is not defined. Often the word is built for another family, or is at the wrong place in the
outputs.

## How it is decided
Each time such a bit is set that was not set in the control word before. All occasions of one slave are one finding that
counts them and lists the words.

## Example
tests/rules/latch-reserved-bits/violates.trace

## What to do
Keep these bits 0. If the values look random, compare the PDO mapping with what the master sends.
)"};

class LatchReservedBits final : public LatchRule {
 public:
  LatchReservedBits() : LatchRule(kInfo, model::LatchMisuse::Kind::kReservedBits) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    const device::LatchDescription& latch = *context().slave(misuse.slave).profile->latch;
    Finding finding = Found(kReservedBitsSet, misuse.slave, misuse.frame);
    finding.Set("reserved_bits_set", arg::Hex(misuse.value))
        .Set("reserved_bits", arg::Hex(latch.reserved_control))
        .Set("by_sdo", arg::Flag(misuse.by_sdo));
    return finding;
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse&) const override { return 0; }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchReservedBits>};

}  // namespace
}  // namespace ecaudit::latch_reserved_bits
