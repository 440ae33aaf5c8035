#include <string>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/text.h"

namespace ecaudit::drive_control_outside_op {
namespace {

constexpr RuleInfo kInfo{
    .id = "drive-control-outside-op",
    .group = "Drive profile (DS402)",
    .severity = Severity::kWarning,
    .title = "The drive is told to enable while its slave is not in OP",
    .needs = "control word 6040h, the slave's AL state, and a family whose manual says when the control word acts",
    .source = "AKD-2011, 4.3; AKD-2010, 4.3; MKD, 4.4; PILZ, 4.4",
    .doc = R"(
## What it checks
Control words (6040h) that command Switch on or Enable operation, in the process data or by SDO, while the slave is
known to be in INIT, PREOP, SAFEOP or BOOT.

## Why it matters
The manuals: the drive acts on the control word in OP only. Before, the command is lost where the drive looks at edges;
where it looks at levels it acts at the very moment the slave reaches OP.

## How it is decided
At the frame in which the word changes to one that asks for more than before; a word that stays the same is not counted
again, and neither is one that stays when the slave falls out of OP. While a change of state is under way nothing is
judged. Shutdown (0x0006), fault reset and words that take torque away are no enable commands.

## Example
samples/captures/drive-enabled-in-safeop.pcapng

## What to do
Send 0 as control word until the slave shows OP, then command the states one after the other.
)"};

class DriveControlOutsideOp final : public Rule {
 public:
  DriveControlOutsideOp() : Rule(kInfo) { Subscribe<model::DriveCommandOutsideOp>(&DriveControlOutsideOp::On); }

  void On(const model::DriveCommandOutsideOp& e) {
    const std::uint64_t key = AxisKey(e.axis) | e.al_state;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    const std::string command = CommandName(drive, {}, 0, e.word);
    const std::string state = esc::StateName(e.al_state);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title = command + " commanded in " + state;
    finding.message = "The control word in frame " + std::to_string(e.frame.number) +
                      (e.by_sdo ? " (SDO)" : " (process data)") + " is " + Hex(e.word) + " (" + command +
                      ") while the slave is in " + state + ". This drive acts on the control word in";
    for (std::size_t i = 0; i < drive.control_word_in.size(); ++i) {
      finding.message += (i == 0 ? " " : " and ") + esc::StateName(static_cast<std::uint8_t>(drive.control_word_in[i]));
    }
    finding.message += " only. Enable the drive once OP is reached.";
    finding.evidence.push_back(HexNumber("control_word", e.word));
    finding.evidence.push_back(Text("al_state", state));
    finding.reference = ReferenceTo(drive.source);
    NameAxis(finding, e.axis);
    Report(key, std::move(finding));
  }

  void Finish() override {
    NotEvaluableFor([](const model::SlaveModel& slave) -> std::string {
      const auto commanded = [](const model::DriveUnit& axis) { return axis.control_seen(); };
      if (!slave.profile->drive || !slave.drives.Any(commanded)) return {};
      if (slave.profile->drive->control_word_in.empty()) {
        return "it is not known in which AL states this drive acts on the control word";
      }
      return slave.al.status_reads() == 0 ? "the AL state is not known" : "";
    });
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveControlOutsideOp>};

}  // namespace
}  // namespace ecaudit::drive_control_outside_op
