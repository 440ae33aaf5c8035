#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/what.h"

namespace ecaudit::drive_reserved_bits {
namespace {

constexpr FindingKind kControl{
    .name = "control-word",
    .title = "Reserved bits {bits} are set in control word {control_word}",
    .message = "The master sends control word {control_word} in {frame}, in OP. Its bits {bits} are reserved.",
    .next =
        "Check whether the control word is mapped where the master writes it: a mapping that is shifted looks like "
        "this.",
    .identity = "bits"};

constexpr const FindingKind* kKinds[] = {&kControl};

constexpr RuleInfo kInfo{.id = "drive-reserved-bits",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kInfo,
                         .title = "Reserved bits of the control word are set",
                         .needs = "control word 6040h; the AL state",
                         .source = "CIA402, control word and status word",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The bits of the control word that the manual of the family, or else the standard, calls reserved.

## Why it matters
A mapping that is shifted by some bytes puts other values there. This shows itself here first.

## How it is decided
The first word in OP in which such a bit is 1.

## Example
tests/rules/drive-reserved-bits/violates.trace

## What to do
Compare the PDO mapping of the slave with the layout that the master uses.
)"};

class DriveReservedBits final : public Rule {
 public:
  DriveReservedBits() : Rule(kInfo) {}

  void Finish() override {
    context().progress().ForEachAxis([&](SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis) {
      if (axis.now().in_op == progress::InOp::kUnknown && !axis.seen_in_op()) {
        NotEvaluable(slave, ReasonCode::kNotInCapture, what::kAlState);
      }
      ReportOf(slave, number, axis.reserved_control());
    });
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  void ReportOf(SlaveId slave, std::uint8_t number, const progress::AxisWatch::Reserved& reserved) {
    if (reserved.bits == 0) return;
    Finding finding = Found(kControl, slave, reserved.frame);
    finding.Set("control_word", arg::Hex(reserved.word));
    std::vector<Value> bits;
    for (unsigned bit = 0; bit < 16; ++bit) {
      if ((reserved.bits >> bit & 1U) != 0) bits.push_back(arg::Number(bit));
    }
    finding.Set("bits", arg::List(std::move(bits)));
    NameAxis(finding, number);
    (void)Report(AxisKey(number), std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveReservedBits>};

}  // namespace
}  // namespace ecaudit::drive_reserved_bits
