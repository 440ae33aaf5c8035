#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/time.h"
#include "decoder/track/network.h"

namespace ecaudit::drive_illegal_state_change {
namespace {

constexpr FindingKind kLeftByItself{
    .name = "left-by-itself",
    .title =
        "[{?pause_ms}Outputs paused for {pause_ms}, then the drive left Operation enabled]"
        "[{!pause_ms}[{?input}Drive left Operation enabled when 60FDh bit {input} ({input_name}) became {level}]"
        "[{!input}Drive left Operation enabled for {state} without a command]]",
    .message =
        R"(The status word shows Operation enabled up to {before_frame} and {state} ({status_word}) in {frame}. The
control word still enables the drive ({control_word}).[{?voltage} Bit 4 (voltage enabled) dropped to 0 with it: the power
stage lost its supply.][{?remote} Bit 9 (remote) dropped to 0 with it: the drive no longer follows the fieldbus (local
control, service tool).][{?pause_ms} Before that, from {paused_from} to {paused_to}, no slave got outputs (LRW, LWR)
for {pause_ms}.][{?inputs_before} The digital inputs (60FDh) changed from {inputs_before} to {inputs} in {input_frame}.])",
    .next =
        R"([{?pause_ms}Find out why the master paused: a drive may supervise its outputs. ][{?input}Find out what switched
this input. ]Check supply, hardware enable (STO) and limit switches, which may cause this, and the drive's own messages.)",
    .identity = "state"};
/// Digital inputs (60FDh) that take the torque away from a drive, by CiA 402.
struct Input {
  std::uint8_t bit = 0;
  Word name;
};
constexpr std::array kInputs{Input{3, {"interlock", "interlock"}},
                             Input{0, {"negative-limit-switch", "negative limit switch"}},
                             Input{1, {"positive-limit-switch", "positive limit switch"}}};
constexpr FindingKind kWithoutCommand{
    .name = "without-command",
    .title = "{state_before} to {state} without a command",
    .message =
        R"(The status word shows {state_before} ({status_word_before}) up to {before_frame} and {state} ({status_word})
in {frame}. This needs {transitions?transition|transitions} {transitions}, which no control word commanded. The control word
has been {control_word} since {control_frame}.)",
    .next = "Look for another source of commands: service tool, enable input, second master.",
    .identity = "state_before state"};
constexpr FindingKind kOtherTarget{
    .name = "other-target",
    .title = "{command} in {state_before}: {state}, not {target}",
    .message =
        R"(Control word {control_word} (since {control_frame}) commands {command} in {state_before}. By the manual this is
transition {transition}, which leads to {target}. The status word shows {state_before} ({status_word_before}) up to
{before_frame} and {state} ({status_word}) in {frame} instead.)",
    .next = "Let the master accept both states, and look into the manual of the firmware.",
    .identity = "state_before state"};
constexpr const FindingKind* kKinds[] = {&kLeftByItself, &kWithoutCommand, &kOtherTarget};

constexpr RuleInfo kInfo{
    .id = "drive-illegal-state-change",
    .group = "Drive profile (DS402)",
    .severity = Severity::kError,
    .history = History::kWhole,
    .title = "The drive changes its state without a command that leads there",
    .needs = "two status words 6041h, and every control word 6040h since one second before the first of them",
    .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
    .kinds = kKinds,
    .doc = R"(
## What it checks
When the status word (6041h) shows another state than before: whether transitions lead there that the drive takes by
itself or that a control word (6040h) commanded.

## Why it matters
A drive that enables itself moves without a request. Or something else commands it: a second control word, a service
tool, a digital input.

## How it is decided
By the transitions 0 to 16 of the state machine.

- Automatic transitions, all that remove torque (supply or hardware enable lost, limit switch) and the fault reset,
  which has other ways, are always possible.
- Transitions 2, 3, 4 and 16 need a control word that commanded them: the active one, or one sent since a second before
  the old state was last shown, also in frames whose answer was lost.
- The drive may have passed several transitions between two status words.
- Not evaluated: words that show no state, changes from a status word of 0 (inputs not valid yet), and changes outside
  OP.

A Quick stop (0x0003) in Switched on is transition 10, to Switch on disabled. A drive that shows Quick stop active
instead followed the command in another way: that is a warning.

A drive may leave Operation enabled by itself for Quick stop active or a state without torque that is no fault. That is
a warning if the control word still enables the drive, and neither mode nor the control bits of the state machine
changed for 0.1 s. What came right before it is named:

- a pause of all outputs (at least 10 ms, and four times as long as usual)
- the interlock or a limit switch in the digital inputs (60FDh bits 3, 0 and 1), if it changed at most 20 ms before

Not evaluated: a control word of an SDO, if the capture does not show what the outputs hold.

## Example
tests/rules/drive-illegal-state-change/violates.trace

## What to do
Look for another source of commands: the service tool, an enable input, a second master. Check that the status word is
mapped where the master reads it.
)"};

constexpr Word kControlWordsBefore{"control-words-before-change", "control words before a change of state", true};

class DriveIllegalStateChange final : public Rule {
 public:
  DriveIllegalStateChange() : Rule(kInfo) {
    Subscribe<model::DriveIllegalChange>(&DriveIllegalStateChange::On);
    Subscribe<model::DriveStateChanged>(&DriveIllegalStateChange::On);
  }

  /// A drive may remove torque at any time, but this is where a stop begins.
  void On(const model::DriveStateChanged& e) {
    using device::DriveState;
    const bool dropped = e.to == DriveState::kSwitchOnDisabled || e.to == DriveState::kReadyToSwitchOn ||
                         e.to == DriveState::kSwitchedOn || e.to == DriveState::kQuickStopActive;
    if (!dropped || e.from != DriveState::kOperationEnabled || e.command.seen()) return;
    const model::SlaveModel& slave = context().slave(e.slave);
    const auto& words = slave.drives.axis(e.axis).control();
    const std::optional<std::uint16_t> control = words.taken;
    constexpr std::uint16_t kEnable = 0x008F, kEnabled = 0x000F;
    if (!control || (*control & kEnable) != kEnabled || !slave.al.SettledIn(esc::AlState::OP)) return;
    // Outputs may hold a control word that overwrites the one of an SDO.
    if (!words.mapped() && !slave.process.rx().known()) {
      return NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kMapping, e.frame.number);
    }
    // What was set shortly before, or in a capture gap, may be why.
    constexpr TimeNs kSettled = 100'000'000;
    if (!e.settings_since.seen() || !e.settings_since.has_time || !e.frame.has_time) return;
    if (Elapsed(e.settings_since.time, e.frame.time) < kSettled) return;
    constexpr std::uint64_t kByItself = 1ULL << 32U;
    const std::uint64_t key = AxisKey(e.axis) | kByItself | static_cast<std::uint8_t>(*e.to);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    // Bits of the status word that dropped together with the state.
    constexpr std::uint16_t kVoltage = 1U << 4U, kRemote = 1U << 9U;
    const auto gone = static_cast<std::uint16_t>(e.word_before.value_or(0) & ~std::uint32_t{e.word});
    Finding finding = Found(kLeftByItself, e.slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("status_word", arg::Hex(e.word))
        .Set("control_word", arg::Hex(*control))
        .Set("state", StateValue(e.to))
        .Set("before_frame", arg::Frame(e.from_last))
        .Set("voltage", arg::Flag((gone & kVoltage) != 0))
        .Set("remote", arg::Flag((gone & kRemote) != 0));
    AddRelated(finding, e.from_last);
    AddPause(finding, e);
    NameAxis(finding, e.axis);
    (void)Report(key, Severity::kWarning, std::move(finding));
  }

  /// What may have kept the outputs away from the drive.
  void AddPause(Finding& finding, const model::DriveStateChanged& e) const {
    if (!context().sync().Uncertainty(sync::TimeBase::kCapture)) return;
    const auto pause = context().sync().pauses().LongestBetween(e.from_last, e.frame);
    if (!pause || context().network().MayMissBetween(pause->from.number, pause->to.number)) return;
    finding.Set("pause_ms", arg::Ms(pause->length()))
        .Set("paused_from", arg::Frame(pause->from.number))
        .Set("paused_to", arg::Frame(pause->to.number));
    AddRelated(finding, pause->from.number);
  }

  /// What the digital inputs showed.
  void AddInputs(SlaveId slave, std::uint8_t axis, const progress::AxisWatch& watch) {
    for (Finding& finding : context().store.findings()) {
      if (finding.kind != &kLeftByItself || finding.slave != slave || finding.axis != axis) continue;
      const auto* const change = watch.InputsAtDrop(finding.first.number);
      if (change == nullptr) continue;
      finding.Set("inputs_before", arg::Hex(change->before, 8))
          .Set("inputs", arg::Hex(change->after, 8))
          .Set("input_frame", arg::Frame(change->frame.number));
      for (const Input& input : kInputs) {
        if (((change->before ^ change->after) >> input.bit & 1U) == 0) continue;
        finding.Set("input", arg::Number(input.bit))
            .Set("input_name", arg::Of(input.name))
            .Set("level", arg::Number(change->after >> input.bit & 1U));
        break;
      }
    }
  }

  void On(const model::DriveIllegalChange& e) {
    const std::uint64_t key =
        AxisKey(e.axis) | std::uint64_t{static_cast<std::uint8_t>(e.from)} << 8U | static_cast<std::uint8_t>(e.to);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    if (ReportOtherTarget(e, drive, key)) return;
    Finding finding = Found(kWithoutCommand, e.slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    std::vector<Value> transitions;
    for (std::uint8_t i = 0; i < e.missing.count; ++i) transitions.push_back(arg::Number(e.missing.numbers[i]));
    finding.Set("status_word_before", arg::Hex(e.word_before))
        .Set("status_word", arg::Hex(e.word))
        .Set("control_word", arg::Hex(e.control))
        .Set("state_before", StateValue(e.from))
        .Set("state", StateValue(e.to))
        .Set("before_frame", arg::Frame(e.from_last))
        .Set("control_frame", arg::Frame(e.control_since))
        .Set("transitions", arg::List(std::move(transitions)));
    AddRelated(finding, e.from_last);
    AddRelated(finding, e.control_since);
    finding.reference = ReferenceTo(drive.source);
    NameAxis(finding, e.axis);
    Report(key, std::move(finding));
  }

  /// The master did command the drive to leave its state; only where it went is another matter.
  bool ReportOtherTarget(const model::DriveIllegalChange& e, const device::DriveProfile& drive, std::uint64_t key) {
    if (e.to != device::DriveState::kQuickStopActive) return false;
    const std::uint32_t commanded = drive.Commanded(e.from, e.control, e.control);
    for (const device::DriveTransition& transition : drive.transitions) {
      if (transition.from != e.from || (commanded >> transition.number & 1U) == 0 || transition.to == e.to) continue;
      const device::DriveCommand* command = CommandOf(drive, transition.number, e.control);
      if (command == nullptr || !CommandsEntry(*command, drive, e.to)) continue;
      Finding finding = Found(kOtherTarget, e.slave, e.frame);
      finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
      finding.Set("command", arg::Text(command->name))
          .Set("state_before", StateValue(e.from))
          .Set("state", StateValue(e.to))
          .Set("target", StateValue(transition.to))
          .Set("transition", arg::Number(transition.number))
          .Set("control_word", arg::Hex(e.control))
          .Set("control_frame", arg::Frame(e.control_since))
          .Set("status_word_before", arg::Hex(e.word_before))
          .Set("status_word", arg::Hex(e.word))
          .Set("before_frame", arg::Frame(e.from_last));
      AddRelated(finding, e.from_last);
      AddRelated(finding, e.control_since);
      finding.reference = ReferenceTo(command->source);
      NameAxis(finding, e.axis);
      Report(key, Severity::kWarning, std::move(finding));
      return true;
    }
    return false;
  }

  static const device::DriveCommand* CommandOf(const device::DriveProfile& drive, std::uint8_t transition,
                                               std::uint16_t control) {
    for (const device::DriveCommand& command : drive.commands) {
      const auto& numbers = command.transitions;
      const bool commands = std::find(numbers.begin(), numbers.end(), transition) != numbers.end();
      if (!command.automatic && commands && command.Matches(control, control)) return &command;
    }
    return nullptr;
  }

  /// In another state the same command leads to `state`: a quick stop from Operation enabled.
  static bool CommandsEntry(const device::DriveCommand& command, const device::DriveProfile& drive,
                            device::DriveState state) {
    return std::any_of(command.transitions.begin(), command.transitions.end(), [&](std::uint8_t number) {
      const device::DriveTransition* transition = drive.Find(number);
      return transition != nullptr && transition->to == state;
    });
  }

  void Finish() override {
    context().progress().ForEachAxis(
        [this](SlaveId slave, std::uint8_t axis, const progress::AxisWatch& watch) { AddInputs(slave, axis, watch); });
    NotEvaluableFor([](const model::SlaveModel& slave) {
      const std::optional<Reason> missing = DriveWordsMissing(slave, true);
      const auto unevaluated = [](const model::DriveUnit& axis) { return axis.unjudged_changes() > 0; };
      if (missing || !slave.drives.Any(unevaluated)) return missing;
      return std::optional(Reason::Of(ReasonCode::kMissesPackets, kControlWordsBefore));
    });
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveIllegalStateChange>};

}  // namespace
}  // namespace ecaudit::drive_illegal_state_change
