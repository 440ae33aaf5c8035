#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit::drive_illegal_command {
namespace {

constexpr FindingKind kNotOffered{
    .name = "not-offered",
    .title = "{command} commanded in {state}[; this state offers {offered} only]",
    .message =
        R"(In {frame} the control word changed from {control_word_before} to {control_word} ({command}). The drive has
been in {state} since {state_frame}.[ This state offers {offered}.][{!offered} No command leads on from this state.])",
    .next = "Command the states in order and wait for each in the status word.",
    .identity = "command state"};
constexpr const FindingKind* kKinds[] = {&kNotOffered};

constexpr Word kOneControlWord{"one-control-word", "a control word (6040h) that is mapped once"};

constexpr RuleInfo kInfo{.id = "drive-illegal-command",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "The control word commands a transition that the drive's state does not offer",
                         .needs = "control word 6040h and status word 6041h, in the process data or by SDO",
                         .source = "CIA402, state machine; AKD-2011, 4.4.2; MKD, 4.4.2; PILZ, 4.4.2",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether a new control word (6040h) that leads towards Operation enabled commands a transition that exists in the state
of the drive (6041h). From Switch on disabled only Shutdown (0x0006) leads on, not Switch on (0x0007) or Enable
operation (0x000F). From Fault only a fault reset leads on.

## Why it matters
The drive ignores the command and the axis stays without torque.

## How it is decided
By the table of the family: AKD and MKD evaluate levels, Pilz edges.

- Only words that ask for more than the word before are evaluated, at the frame in which they change. Words that remove
  torque are right in every state.
- A command is early, not illegal, if an earlier one is still in progress or the drive reaches a fitting state within 1
  s.
- 0x0007 is Disable operation as well: before 0x0006 and 0x0000 it is the first step of switching off.
- Mode bits and halt are ignored.
- Nothing is evaluated before the state is known, in Not ready to switch on and in Fault reaction active.

## Example
samples/captures/drive-illegal-command.pcapng

## What to do
Command one state after the other and wait for the status word: 0x0006, 0x0007, 0x000F. After a fault, send a rising
edge of bit 7 first.
)"};

class DriveIllegalCommand final : public Rule {
 public:
  DriveIllegalCommand() : Rule(kInfo) { Subscribe<model::DriveIllegalCommand>(&DriveIllegalCommand::On); }

  void On(const model::DriveIllegalCommand& e) {
    const std::uint64_t key = AxisKey(e.axis) | std::uint64_t{static_cast<std::uint8_t>(e.state)} << 16U | e.word;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    Finding finding = Found(kNotOffered, e.slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("control_word", arg::Hex(e.word))
        .Set("control_word_before", arg::Hex(e.before))
        .Set("state", StateValue(e.state))
        .Set("command", arg::Text(CommandName(drive, {}, e.before, e.word)))
        .Set("state_frame", arg::Frame(e.state_since));
    if (std::vector<Value> offered = Offered(drive, e.state); !offered.empty()) {
      finding.Set("offered", arg::List(std::move(offered)));
    }
    AddRelated(finding, e.state_since);
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
    const auto ambiguous = [](const model::DriveUnit& axis) { return axis.control().ambiguous > 0; };
    NotEvaluableWhere([&](const model::SlaveModel& slave) { return slave.drives.Any(ambiguous); },
                      Reason::Of(ReasonCode::kNotInCapture, kOneControlWord));
  }

 private:
  /// The commands that lead on from `state`: "Shutdown".
  static std::vector<Value> Offered(const device::DriveProfile& drive, device::DriveState state) {
    std::vector<Value> list;
    for (const device::DriveTransition& transition : drive.transitions) {
      if (transition.from != state || transition.automatic) continue;
      for (const device::DriveCommand& command : drive.commands) {
        bool commands = false;
        for (const std::uint8_t number : command.transitions) commands = commands || number == transition.number;
        if (!commands || command.automatic) continue;
        list.push_back(arg::Text(command.name));
        break;
      }
    }
    return list;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveIllegalCommand>};

}  // namespace
}  // namespace ecaudit::drive_illegal_command
