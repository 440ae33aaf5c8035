#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_outside_op {
namespace {

constexpr FindingKind kUsedOutsideOp{
    .name = "used-outside-op",
    .title = "Latch control word changed to {control_word} outside OP[ (in {al_state})]",
    .message =
        R"(The latch control word changed from {control_word_before} to {control_word}[{?by_sdo} by SDO] in {frame}.
The slave is [in {al_state}][{!al_state}in a state other than OP]. Drives process outputs only in OP.)",
    .next = "Use the latch after the slave has reached OP.",
    .identity = "al_state"};

constexpr const FindingKind* kKinds[] = {&kUsedOutsideOp};

constexpr RuleInfo kInfo{.id = "latch-outside-op",
                         .group = "Latch",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "The master uses the latch while the slave is not in OP",
                         .needs = "the AL state of the slave and two latch control words",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether enable bits or a read selector are set in the latch control word while the slave is not in OP.

## Why it matters
The drive does not process outputs outside OP. The latch is not armed, although the master expects a capture.

## How it is decided
An enable bit that was 0 in the word before, or another selector, while none of the states that the slave may be in is
OP. Bits that are only cleared do not count: masters do that on their way down. Words by SDO count like those in process
data.

## Example
tests/rules/latch-outside-op/violates.trace

## What to do
Arm the latch after the slave has reached OP.
)"};

class LatchOutsideOp final : public LatchRule {
 public:
  LatchOutsideOp() : LatchRule(kInfo, model::LatchMisuse::Kind::kOutsideOp) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    Finding finding = Found(kUsedOutsideOp, misuse.slave, misuse.frame);
    if (misuse.state != 0) finding.Set("al_state", arg::State(misuse.state));
    finding.Set("control_word_before", arg::Hex(misuse.control_before)).Set("by_sdo", arg::Flag(misuse.by_sdo));
    return finding;
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse& misuse) const override { return misuse.state; }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchOutsideOp>};

}  // namespace
}  // namespace ecaudit::latch_outside_op
