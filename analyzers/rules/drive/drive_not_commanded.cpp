#include <array>

#include "analyzers/judge/axis_rule.h"
#include "analyzers/words/what.h"

namespace ecaudit::drive_not_commanded {
namespace {

constexpr FindingKind kStartMissing{
    .name = "start-bit-missing",
    .title = "Bit {start_bit} of the control word never rises: no start in mode {start_mode}",
    .message =
        R"(The drive is enabled in mode {start_mode}.[{?homing} Homing is selected][{!homing} Its target changes], but bit
{start_bit} of the control word stays 0 from {frame} on, for {lasted_ms} (control word {control_word}, {shown_frame}). The
rising edge of bit {start_bit} starts the motion.)",
    .next =
        "[{!homing}Set bit 4 after the target is written, and clear it after the drive has acknowledged.]"
        "[{?homing}Set bit {start_bit} to start homing.]",
    .identity = "start_mode"};

constexpr FindingKind kStartStands{
    .name = "start-bit-stands",
    .title = "Bit {start_bit} of the control word stays 1: no rising edge in mode {start_mode}",
    .message =
        R"(The drive is enabled in mode {start_mode}.[{?homing} Homing is selected][{!homing} Its target changes], but bit
{start_bit} of the control word stays 1 from {frame} on, for {lasted_ms} (control word {control_word}, {shown_frame}).
Each motion needs a rising edge of bit 4.)",
    .next =
        "[{!homing}Clear bit 4 after the drive has acknowledged (bit 12 of the status word), and set it for the next "
        "motion.][{?homing}Clear bit {start_bit}, and set it again to start homing.]",
    .identity = "start_mode"};

constexpr FindingKind kNotAcknowledged{
    .name = "setpoint-not-acknowledged",
    .title = "The drive does not acknowledge the new set point (status bit 12)",
    .message =
        R"(Bit 4 of the control word rises in {frame}. {lasted_ms} later bit 12 (set-point acknowledge) of the status word
{status_word} is still 0 ({shown_frame}). The drive is in {state}, mode {mode}.)",
    .next =
        "Check that 6061h shows the mode, that the target is inside the limits (607Dh), and that the drive needs no "
        "homing first.",
    .identity = ""};

constexpr FindingKind kHalt{
    .name = "halt-stands",
    .title = "Halt (bit 8 of the control word) stays 1: the axis does not start",
    .message =
        R"(The drive is enabled in mode {start_mode} and a motion is commanded. Bit 8 (halt) of the control word
{control_word} is 1 from {frame} on, for {lasted_ms} ({shown_frame}). The master did not clear it since the
drive was enabled.)",
    .next = "Clear bit 8 of the control word.",
    .identity = ""};

constexpr FindingKind kModeOverwritten{
    .name = "mode-overwritten",
    .title = "Mode {by_sdo} set by SDO is overwritten by {mapped} in process data",
    .message =
        R"(The master selected mode {by_sdo} by SDO (6060h). The process data hold {mapped} for the same object in every
cycle. The drive shows mode {shown} (6061h) from {frame} to {shown_frame}, for {lasted_ms}.)",
    .next = "Write the mode into the process data, or take 6060h out of the PDO mapping.",
    .identity = "by_sdo mapped"};

constexpr FindingKind kNoMode{
    .name = "no-mode",
    .title = "{changing:number} changes, but no mode of operation is selected",
    .message =
        R"(The drive is enabled and {changing} changes from {frame} on, for {lasted_ms}. [{!by_sdo}The drive shows mode 0
(6061h, {shown_frame}), and the master selects none (6060h).][{?by_sdo}The master wrote mode 0 (6060h) by SDO, which is no
mode. The mode display (6061h) is not in the capture. The actual value does not follow ({shown_frame}).])",
    .next = "Select the mode of operation (6060h) before the drive is enabled.",
    .identity = "changing"};

constexpr FindingKind kNotMapped{
    .name = "setpoint-not-mapped",
    .title = "Mode {start_mode} needs {needed:number}, the master sends {changing:number}",
    .message =
        R"(The drive is enabled in mode {start_mode}, whose set point is {needed}. This object [{?constant}does not
change][{!constant}is not mapped]. {changing} changes from {frame} on, for {lasted_ms} ({shown_frame}), and this mode does not use it.)",
    .next = "[{?constant}Change][{!constant}Map] {needed:number}, or select the mode that uses {changing:number}.",
    .identity = "start_mode changing"};

constexpr FindingKind kRamp{
    .name = "ramp-bits-missing",
    .title = "Bits 4 to 6 of control word {control_word} keep the ramp at 0",
    .message =
        R"(The drive is enabled in mode {mode} with target velocity {target}. The actual velocity is 0 from {frame} on, for
{lasted_ms} ({shown_frame}). In this mode bits 4 (enable ramp), 5 (unlock ramp) and 6 (reference ramp) of the
control word have to be 1.)",
    .next = "Send 0x007f instead of 0x000f.",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {&kStartMissing,    &kStartStands, &kNotAcknowledged, &kHalt,
                                         &kModeOverwritten, &kNoMode,      &kNotMapped,       &kRamp};

constexpr RuleInfo kInfo{.id = "drive-not-commanded",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "The drive is enabled and a motion is wanted, but nothing starts it",
                         .needs = "control word, status word, mode and set points with time stamps, from enabling on",
                         .source = "CIA402, modes of operation",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether what starts a motion comes when a motion is wanted:

- the rising edge of bit 4 in profile position and homing (homing: or of the bit that the manual names), and its
  acknowledge (bit 12 of the status word)
- halt (bit 8) cleared
- bits 4 to 6 in velocity mode (2)
- a mode that the drive shows and that fits the set point
- 6060h not overwritten by process data

## Why it matters
The drive is enabled and holds its position. No fault and no error shows why it does not move.

## How it is decided
A motion is wanted if the set point changes while the drive is enabled. An enabled axis with a constant set point is
idle, and so is one whose target position copies the position actual value. Limits: 1 s, in homing 2 s, for the
acknowledge 500 ms.

- If the start comes later (the edge of bit 4, halt cleared, bits 4 to 6), the machine only waited: no finding.
- If the capture holds a start of the same axis, a missing edge is no finding.
- Homing that is selected may wait for an operator: an info.
- A bit 4 that stays 1 counts while bit 10 (target reached) is 1.
- Interpolated position without bit 4 counts if the position actual value (6064h) does not move.
- 6060h counts as overwritten if 6061h shows another mode.
- Without 6061h in the capture, mode 0 written by SDO counts if the actual value does not follow: inferred. The drive
  may have kept another mode.
- A set point that is not mapped may have been written by SDO before, except in the cyclic modes: inferred.

## Example
tests/rules/drive-not-commanded/violates.trace: profile position without bit 4.

## What to do
The finding names the bit or object. Check the sequence of the master against the chapter of the mode in the manual.
)"};

constexpr std::array kRows{
    AxisRule::Row{progress::AxisFact::kStartMissing, &kStartMissing},
    AxisRule::Row{progress::AxisFact::kStartStands, &kStartStands},
    AxisRule::Row{progress::AxisFact::kNotAcknowledged, &kNotAcknowledged},
    AxisRule::Row{progress::AxisFact::kHaltStands, &kHalt},
    AxisRule::Row{progress::AxisFact::kOverwrittenMode, &kModeOverwritten},
    AxisRule::Row{progress::AxisFact::kNoMode, &kNoMode},
    AxisRule::Row{progress::AxisFact::kSetpointNotMapped, &kNotMapped},
    AxisRule::Row{progress::AxisFact::kRampBits, &kRamp},
};

class DriveNotCommanded final : public AxisRule {
 public:
  DriveNotCommanded() : AxisRule(kInfo, kRows) {}

 private:
  void Describe(Finding& finding, const progress::AxisRecord& record, const progress::AxisWatch& axis) override {
    switch (record.fact) {
      case progress::AxisFact::kStartMissing:
      case progress::AxisFact::kStartStands:
        if (record.a == progress::kHoming) finding.Set("homing", arg::Flag());
        finding.Set("start_bit", arg::Number(axis.now().StartBitOf(static_cast<std::int8_t>(record.a))));
        finding.Set("start_mode", ModeOf(record.a));
        return;
      case progress::AxisFact::kHaltStands:
        finding.Set("start_mode", ModeOf(record.a));
        return;
      case progress::AxisFact::kOverwrittenMode:
        finding.Set("by_sdo", arg::Number(record.a)).Set("mapped", arg::Number(record.b));
        finding.Set("shown", arg::Number(record.c));
        return;
      case progress::AxisFact::kRampBits:
        finding.Set("target", arg::Number(record.a));
        return;
      case progress::AxisFact::kNoMode:
        finding.Set("changing", ObjectOf(record.c));
        if (record.by_sdo) finding.Set("by_sdo", arg::Flag());
        return;
      case progress::AxisFact::kSetpointNotMapped:
        finding.Set("start_mode", arg::Number(record.a)).Set("needed", ObjectOf(record.b));
        finding.Set("changing", ObjectOf(record.c));
        if (record.constant) finding.Set("constant", arg::Flag());
        return;
      default:
        return;
    }
  }

  [[nodiscard]] std::optional<Reason> Unevaluated(const progress::AxisWatch& axis) const override {
    if (!axis.enabled().ever()) return std::nullopt;
    if (!axis.now().mode()) return Reason::Of(ReasonCode::kNotInCapture, what::kMode);
    if (axis.command().commanded().seen()) return std::nullopt;
    if (axis.command().without_setpoint()) return Reason::Of(ReasonCode::kNotInCapture, kSetpoint);
    return std::nullopt;
  }

  static constexpr Word kSetpoint{"setpoint", "the set point of the mode as an object of CiA 402"};
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveNotCommanded>};

}  // namespace
}  // namespace ecaudit::drive_not_commanded
