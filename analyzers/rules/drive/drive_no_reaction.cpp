#include <algorithm>
#include <cstdint>
#include <utility>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/pending_findings.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit::drive_no_reaction {
namespace {

constexpr FindingKind kNoEffect{
    .name = "no-effect",
    .title =
        "[{?solved}{command} in {state} takes more than {limit_ms}][{!solved}{command} has no effect in {state}]"
        "[{?no_voltage}: no voltage (bit 4 = 0)][{!solved}[{?local}: local control (bit 9)]]",
    .message = R"(The control word {control_word} of {command_frame} commands {command} (transition {transition}[ to
{target}]). In {frame}, {waited_ms} later, the status word is still {status_word} ({state}). The limit is
{limit_ms}.[{?no_voltage} Bit 4 of the status word is 0: the drive has no supply voltage.][{?local} Bit 9 (remote) of the
status word is 0: the drive does not act on the control word.])",
    .next =
        R"([{?edge}Send bit {edge} of the control word as 0, then as 1 ({word_without}, then
{word_with}).][{!edge}[{?no_voltage}Check the supply, hardware enable and safe torque off.][{?in_fault}The cause of
the fault may still be present: read the fault from the drive (1003h).][{?local}Give the control to the fieldbus: close
the commissioning software, and check the command source.][{!no_voltage}[{!in_fault}[{!local}Check hardware enable, safe
torque off and whether the fieldbus may control the drive.]]]])",
    .identity = "transition"};
constexpr const FindingKind* kKinds[] = {&kNoEffect};

constexpr NoteKind kEnabledLater{.name = "enabled-later", .text = "The drive shows Operation enabled in {frame}."};
constexpr NoteKind kEdge{
    .name = "edge-in-description",
    .text =
        "The manual contradicts itself. By its description ({described}), a positive edge of bit {bit} leaves {state}. "
        "Its table of commands ({commanded}) prints the level {level}. Bit {bit} was already 1 before {command_frame}, "
        "so there was no edge."};
constexpr const NoteKind* kNotes[] = {&kEnabledLater, &kEdge};

constexpr RuleInfo kInfo{.id = "drive-no-reaction",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "A legal command of the control word has no effect within the limit",
                         .needs = "control word 6040h and status word 6041h with time stamps",
                         .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Whether the drive leaves its state within 1 s after a control word (6040h) commanded a transition that its state offers,
while the command stays. From Operation enabled the limit is 10 s, since the axis may have to stop first.

## Why it matters
The sequence of the master stops here. A drive ignores a legal command if a condition is missing: supply, hardware
enable, safe torque off, a fault whose cause is still present, control over the fieldbus switched off.

## How it is decided
Each status word that arrives after the limit and still shows the old state.

- A command that is withdrawn before is not evaluated, nor the time in which the slave may still be on its way to OP.
- Bit 9 (remote) of the status word shows whether the drive acts on the control word. If it is 0, the title names it.
  Not if the drive followed a command of the capture with bit 9 at 0: then it does not use this bit.
- Transition 16 is not evaluated: drives may leave it out.
- If the drive shows Operation enabled after that, the finding is an info: a supply that comes up, or a machine that
  waited.
- A word that commands several steps (0x000F in Ready to switch on) is evaluated step by step.

## Example
tests/rules/drive-no-reaction/violates.trace

## What to do
Check bit 4 of the status word (voltage enabled), the hardware enable and safe torque off inputs, and the fault history
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
    if (pending_.Repeat(e.slave, key, e.frame)) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    const device::DriveTransition* transition = drive.Find(e.transition);
    model::DrivePath path;
    path.Add(e.transition);
    // As if all its edges had just happened: only the name counts.
    Finding finding = Found(kNoEffect, e.slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    const bool no_voltage = (e.status & 0x0010U) == 0;
    const bool in_fault = !no_voltage && e.state == device::DriveState::kFault;
    const bool local = !no_voltage && !in_fault && (e.status >> progress::kRemoteBit & 1U) == 0;
    finding.Set("control_word", arg::Hex(e.word))
        .Set("status_word", arg::Hex(e.status))
        .Set("state", StateValue(e.state))
        .Set("transition", arg::Number(e.transition))
        .Set("waited_ms", arg::Ms(e.waited_ns))
        .Set("limit_ms", arg::Ms(e.limit_ns))
        .Set("command", arg::Text(CommandName(drive, path, e.before, e.word)))
        .Set("command_frame", arg::Frame(e.command.number))
        .Set("no_voltage", arg::Flag(no_voltage))
        .Set("in_fault", arg::Flag(in_fault))
        .Set("local", arg::Flag(local));
    if (transition != nullptr) finding.Set("target", StateValue(transition->to));
    DescribeEdge(finding, e, drive);
    AddRelated(finding, e.command.number);
    finding.reference = ReferenceTo(drive.source);
    NameAxis(finding, e.axis);
    pending_.Keep(key, std::move(finding));
  }

  void Finish() override {
    pending_.Release([this](std::uint64_t key, Finding finding) {
      const progress::AxisWatch* const axis = context().progress().axis(finding.slave, finding.axis);
      const FrameRef enabled = axis != nullptr ? axis->enable().enabled_since() : FrameRef{};
      if (axis != nullptr && axis->enable().ignores_remote()) finding.Set("local", arg::Flag(false));
      const FrameRef& last = finding.last.seen() ? finding.last : finding.first;
      if (enabled.number <= last.number) {
        (void)Report(key, std::move(finding));
        return;
      }
      finding.Set("solved", arg::Flag());
      Arguments later;
      later.Set("frame", arg::Frame(enabled.number));
      finding.Add(kEnabledLater, std::move(later));
      AddRelated(finding, enabled.number);
      (void)Report(key, Severity::kInfo, std::move(finding));
    });
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
  PendingFindings pending_;  // the drive may be slow only

  /// The drive may wait for an edge that only the description of the state names.
  static void DescribeEdge(Finding& finding, const model::DriveNoReaction& e, const device::DriveProfile& drive) {
    const device::DriveStateRow* row = drive.FindState(e.state);
    if (row == nullptr || !row->edge_bit) return;
    const unsigned bit = *row->edge_bit;
    const auto has = [bit](std::uint16_t word) { return (word >> bit & 1U) != 0; };
    if (!has(e.word) || !has(e.before)) return;
    const device::DriveCommand* command = nullptr;
    for (const device::DriveCommand& known : drive.commands) {
      const bool commands =
          std::find(known.transitions.begin(), known.transitions.end(), e.transition) != known.transitions.end();
      if (commands && (known.mask >> bit & 1U) != 0) command = &known;
    }
    // The table has to print the level that was sent.
    if (command == nullptr || !has(command->value)) return;
    const auto without = static_cast<std::uint16_t>(e.word & ~(1U << bit));
    finding.Set("edge", arg::Number(bit)).Set("word_without", arg::Hex(without)).Set("word_with", arg::Hex(e.word));
    finding.Add(kEdge, {{"described", arg::Text(row->source)},
                        {"bit", arg::Number(bit)},
                        {"state", StateValue(e.state)},
                        {"commanded", arg::Text(command->source)},
                        {"level", arg::Number(1)},
                        {"command_frame", arg::Frame(e.command.number)}});
  }

  static std::optional<Reason> Unevaluated(const model::DriveUnit& axis) {
    if (axis.without_time()) return Reason::Of(ReasonCode::kNoStamps);
    // No command is legal then, so none is without effect.
    if (!axis.status().state && axis.status().word == 0) {
      return Reason::Of(ReasonCode::kNotInCapture, kValidStatus);
    }
    if (axis.status().state == device::DriveState::kNotReadyToSwitchOn) {
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
