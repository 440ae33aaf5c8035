#include <string>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/text.h"

namespace ecaudit::drive_no_reaction {
namespace {

constexpr RuleInfo kInfo{.id = "drive-no-reaction",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "A legal command of the control word has no effect within the limit",
                         .needs = "control word 6040h and status word 6041h with time stamps",
                         .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
                         .doc = R"(
## What it checks
Whether the drive leaves its state within 1 s (10 s from Operation enabled, where the axis may have to stop first)
after a control word (6040h) commanded a transition that its state offers, while the command stands.

## Why it matters
The master's sequence stops here. A drive ignores a legal command when something else keeps it: no supply, hardware
enable or safe torque off missing, a fault whose cause is still there, control over the fieldbus switched off.

## How it is decided
Each status word that arrives past the limit and still shows the old state. A command that is taken back before is not
judged, nor the time in which the slave may still be on its way to OP, nor transition 16, which drives may leave out.
A word that commands several steps (0x000F in Ready to switch on: Switch on, then Enable operation) is judged step by
step.

## Example
tests/rules/drive-no-reaction/violates.trace

## What to do
Look at bit 4 of the status word (voltage enabled), the hardware enable and safe torque off inputs, the fault history
(1003h). Limits: drive-no-reaction, drive-no-reaction.stop (milliseconds) in the configuration file.
)"};

constexpr Word kValidStatus{"valid-status-word", "a status word other than 0"};
constexpr Word kReadyDrive{"ready-drive", "a state above Not ready to switch on"};
constexpr Word kActingState{"acting-al-state", "the AL state in which the drive acts on the control word"};

class DriveNoReaction final : public Rule {
 public:
  DriveNoReaction() : Rule(kInfo) { Subscribe<model::DriveNoReaction>(&DriveNoReaction::On); }

  void On(const model::DriveNoReaction& e) {
    const std::uint64_t key = AxisKey(e.axis) | e.transition;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    const device::DriveTransition* transition = drive.Find(e.transition);
    model::DrivePath path;
    path.Add(e.transition);
    // Asked for as if all its edges had just happened: only the name counts.
    const std::string command = CommandName(drive, path, e.before, e.word);
    const std::string state = StateText(e.state);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = command + " has no effect in " + state;
    finding.message = "The control word " + Hex(e.word) + " of frame " + std::to_string(e.command.number) +
                      " commands " + command + " (" + PathText(path);
    if (transition != nullptr) finding.message += " to " + StateText(transition->to);
    finding.message += "); in frame " + std::to_string(e.frame.number) + ", " + MillisecondsText(e.waited_ns) +
                       " later, the status word is still " + Hex(e.status) + " (" + state + "). Limit " +
                       MillisecondsText(e.limit_ns) + ". ";
    finding.message += (e.status & 0x0010U) == 0
                           ? "Bit 4 of the status word is 0: the drive has no supply voltage. Check supply, hardware "
                             "enable and safe torque off."
                       : e.state == device::DriveState::kFault
                           ? "The cause of the fault may still be there: read the fault from the drive (1003h)."
                           : "Check hardware enable, safe torque off and whether the fieldbus may control the drive.";
    AddRelated(finding, e.command.number);
    finding.evidence.push_back(HexNumber("control_word", e.word));
    finding.evidence.push_back(HexNumber("status_word", e.status));
    finding.evidence.push_back(Text("state", state));
    finding.evidence.push_back(Number("transition", e.transition));
    finding.evidence.push_back(Real("waited_ms", static_cast<double>(e.waited_ns) / 1e6));
    finding.evidence.push_back(Real("limit_ms", static_cast<double>(e.limit_ns) / 1e6));
    finding.reference = ReferenceTo(drive.source);
    NameAxis(finding, e.axis);
    Report(key, std::move(finding));
  }

  void Finish() override {
    NotEvaluableFor([](const model::SlaveModel& slave) {
      std::optional<Reason> why = DriveWordsMissing(slave, true);
      if (why) return why;
      slave.drives.ForEachSeen([&why](const model::DriveUnit& axis) {
        if (!why) why = Unevaluated(axis);
      });
      return why;
    });
  }

 private:
  static std::optional<Reason> Unevaluated(const model::DriveUnit& axis) {
    if (axis.without_time()) return Reason::Of(ReasonCode::kNoStamps);
    // No command is legal then, so none is without effect.
    if (!axis.state() && axis.status_word() == 0) {
      return Reason::Of(ReasonCode::kNotInCapture, kValidStatus);
    }
    if (axis.state() == device::DriveState::kNotReadyToSwitchOn) {
      return Reason::Of(ReasonCode::kNotInCapture, kReadyDrive);
    }
    if (axis.may_not_act()) {
      return Reason::Of(ReasonCode::kNotInCapture, kActingState);
    }
    return std::nullopt;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveNoReaction>};

}  // namespace
}  // namespace ecaudit::drive_no_reaction
