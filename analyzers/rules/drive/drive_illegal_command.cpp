#include <string>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/text.h"

namespace ecaudit::drive_illegal_command {
namespace {

constexpr RuleInfo kInfo{.id = "drive-illegal-command",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "The control word commands a transition that the drive's state does not offer",
                         .needs = "control word 6040h and status word 6041h, in the process data or by SDO",
                         .source = "CIA402, state machine; AKD-2011, 4.4.2; MKD, 4.4.2; PILZ, 4.4.2",
                         .doc = R"(
## What it checks
Whether a new control word (6040h) that wants the drive nearer to Operation enabled commands a transition that exists
in the state the drive shows (6041h). From Switch on disabled only Shutdown (0x0006) leads on, not Switch on (0x0007)
or Enable operation (0x000F); from Fault nothing does but a fault reset.

## Why it matters
The drive ignores the command and the axis stays without torque, while the master believes that it asked for it.

## How it is decided
By the family's table: AKD and MKD look at levels, Pilz at edges. Only words that ask for more than the word before are
judged, at the frame in which they change; words that take torque away are right in every state. A command counts as
early, not as illegal, when an earlier one is still being carried out or the drive reaches a fitting state within 1 s.
0x0007 is Disable operation as well: followed by 0x0006 and 0x0000 it was the first step of switching off. Bits that
the state machine does not look at (mode bits, halt) are left out. Nothing is judged before the state is shown, in Not
ready to switch on and in Fault reaction active.

## Example
samples/captures/drive-illegal-command.pcapng

## What to do
Let the master command one state after the other and wait for the status word: 0x0006, 0x0007, 0x000F; after a fault a
rising edge of bit 7 first.
)"};

class DriveIllegalCommand final : public Rule {
 public:
  DriveIllegalCommand() : Rule(kInfo) { Subscribe<model::DriveIllegalCommand>(&DriveIllegalCommand::On); }

  void On(const model::DriveIllegalCommand& e) {
    const std::uint64_t key = AxisKey(e.axis) | std::uint64_t{static_cast<std::uint8_t>(e.state)} << 16U | e.word;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    const std::string command = CommandName(drive, {}, e.before, e.word);
    const std::string state = StateText(e.state);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = command + " commanded in " + state;
    finding.message = "In frame " + std::to_string(e.frame.number) + " the control word went from " + Hex(e.before) +
                      " to " + Hex(e.word) + " (" + command + ") while the drive shows " + state + " since frame " +
                      std::to_string(e.state_since) + ". " + Offered(drive, e.state) +
                      " Command the states one after the other and wait for each.";
    AddRelated(finding, e.state_since);
    finding.evidence.push_back(HexNumber("control_word", e.word));
    finding.evidence.push_back(HexNumber("control_word_before", e.before));
    finding.evidence.push_back(Text("state", state));
    finding.reference = ReferenceTo(drive.commands.empty() ? std::string_view(drive.source)
                                                           : std::string_view(drive.commands.front().source));
    NameAxis(finding, e.axis);
    Report(key, std::move(finding));
  }

  void Finish() override {
    for (std::size_t id = 0; id < context().slave_count(); ++id) {
      const auto slave = static_cast<SlaveId>(id);
      // What nothing made legal until the capture ended.
      context().slave(slave).drives.ForEachSeen([&](const model::DriveUnit& axis) {
        if (const auto command = axis.undecided_command()) On(*command);
      });
    }
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, true); });
    const auto ambiguous = [](const model::DriveUnit& axis) { return axis.ambiguous_controls() > 0; };
    NotEvaluableWhere([&](const model::SlaveModel& slave) { return slave.drives.Any(ambiguous); },
                      "the control word (6040h) is mapped several times with different values");
  }

 private:
  /// "This state offers Shutdown (transition 2)."
  static std::string Offered(const device::DriveProfile& drive, device::DriveState state) {
    std::string list;
    for (const device::DriveTransition& transition : drive.transitions) {
      if (transition.from != state || transition.automatic) continue;
      for (const device::DriveCommand& command : drive.commands) {
        bool commands = false;
        for (const std::uint8_t number : command.transitions) commands = commands || number == transition.number;
        if (!commands || command.automatic) continue;
        list += (list.empty() ? "" : ", ") + command.name + " (transition " + std::to_string(transition.number) + ")";
        break;
      }
    }
    return list.empty() ? "No command leads on from this state." : "This state offers " + list + ".";
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveIllegalCommand>};

}  // namespace
}  // namespace ecaudit::drive_illegal_command
