#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_outside_op {
namespace {

constexpr RuleInfo kInfo{.id = "latch-outside-op",
                         .group = "Latch",
                         .severity = Severity::kWarning,
                         .title = "The latch is used while the slave is not in OP",
                         .needs = "the AL state of the slave and two latch control words",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether enable bits or a read selector are set in the latch control word while the slave is not in OP.

## Why it matters
Outputs are not processed outside OP: the latch is not armed although the master believes so.

## How it is decided
An enable bit that was 0 in the word before, or another selector, while none of the states that the slave may be in is
OP. Bits that are only cleared do not count: masters do that on their way down. Words by SDO count as those in process
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
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    const std::string state = misuse.state == 0 ? "a state other than OP" : esc::StateName(misuse.state);
    finding.title = "Latch control word changed to " + Hex(misuse.control) + " in " + state;
    finding.message = "The latch control word went from " + Hex(misuse.control_before) + " to " + Hex(misuse.control) +
                      " " + FrameText(misuse) + " while the slave is in " + state +
                      ". Outputs are processed in OP only. Use the latch after the slave has reached OP.";
    finding.evidence.push_back(Text("al_state", state));
    finding.evidence.push_back(HexNumber("control_word_before", misuse.control_before));
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse& misuse) const override { return misuse.state; }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchOutsideOp>};

}  // namespace
}  // namespace ecaudit::latch_outside_op
