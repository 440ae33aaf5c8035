#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::drive_sdo_control_word {
namespace {

constexpr FindingKind kOverwritten{
    .name = "overwritten",
    .title = "Control word {control_word} written by SDO, but {object:number} is mapped",
    .message = R"(The master writes {control_word} to {object} by SDO in {frame}, in OP. The object is in the outputs as
well, and the last frame with outputs has {cyclic_word}. The next one overwrites what the SDO wrote. The drive accepted
the download, so the master gets no error.)",
    .next = "Command the drive in the outputs, or take {object:number} out of the mapping.",
    .identity = "object"};

constexpr const FindingKind* kKinds[] = {&kOverwritten};

constexpr Word kOutputMapping{"output-mapping", "the mapping of the outputs"};

constexpr RuleInfo kInfo{.id = "drive-sdo-control-word",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kInfo,
                         .title = "The control word is written by SDO while it is in the outputs",
                         .needs = "SDO downloads of 6040h, the mapping of the outputs, AL state OP",
                         .source = "AKD-2011, 3.5.3; MKD, 3.7.3",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Downloads of the control word (6040h, of each axis) in OP while the outputs hold the same object with another value.

## Why it matters
The next cycle overwrites it. A service tool that enables the drive or resets a fault in this way has no effect, though
each download is accepted.

## How it is decided
- The slave is in OP, and the master exchanges outputs with it.
- The object is in the mapping of the outputs, and the last control word there is another one.
- A download that repeats the value of the outputs is ignored.
- One that asks for more than the outputs do (enable) is reported by drive-not-enabled if the drive stays disabled.

## Example
tests/rules/drive-sdo-control-word/violates.trace

## What to do
Command the drive in the outputs only. To work with a service tool, stop the cyclic exchange first.
)"};

class DriveSdoControlWord final : public Rule {
 public:
  DriveSdoControlWord() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&DriveSdoControlWord::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || !t.has_object || t.subindex != 0) return;
    const auto axis = progress::AxisOf(t.index);
    if (!axis || axis->second != model::kControlWord || t.data.size() != sizeof(std::uint16_t)) return;
    const model::SlaveModel& slave = context().slave(t.slave);
    if (t.outcome != mailbox::SdoOutcome::kCompleted || !slave.al.SettledIn(esc::AlState::OP)) return;
    const model::ProcessLayout& outputs = slave.process.rx();
    if (slave.outputs.exchanged == 0) return;
    if (!outputs.known()) {
      NotEvaluable(t.slave, ReasonCode::kNotInCapture, kOutputMapping, t.request.number);
      return;
    }
    const progress::AxisWatch* const watch = context().progress().axis(t.slave, axis->first);
    if (outputs.Find(t.index, 0) == nullptr || watch == nullptr || !watch->now().control) return;
    const auto word = LittleEndian<std::uint16_t>(t.data, 0);
    const std::uint16_t cyclic = *watch->now().control;
    const bool enables = (word & ~cyclic & progress::kEnableWord) != 0;
    if (word == cyclic || enables || Repeat(t.slave, AxisKey(axis->first), t.request) != kNoFinding) return;
    Finding finding = Found(kOverwritten, t.slave, t.request);
    finding.confidence = outputs.assumed ? Confidence::kInferred : ConfidenceOf(t.certainty);
    finding.Set("control_word", arg::Hex(word))
        .Set("object", arg::Object(t.index))
        .Set("cyclic_word", arg::Hex(cyclic));
    NameAxis(finding, axis->first);
    AddRelated(finding, watch->now().control_since.number);
    (void)Report(AxisKey(axis->first), std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveSdoControlWord>};

}  // namespace
}  // namespace ecaudit::drive_sdo_control_word
