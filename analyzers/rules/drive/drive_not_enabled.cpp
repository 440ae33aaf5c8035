#include <array>
#include <string>
#include <utility>

#include "analyzers/judge/axis_rule.h"
#include "analyzers/judge/rule_context.h"

namespace ecaudit::drive_not_enabled {
namespace {

constexpr FindingKind kBitMissing{
    .name = "control-bit-missing",
    .title = "Missing in control word {control_word}[{?solved} for {lasted_ms}]: {bits}",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. Its bit 3 asks for Operation
enabled, but {bits} {bit_count?is|are} 0. The drive shows {state} (status word {status_word}, {shown_frame}).
Enable operation needs bits 0 to 3 set (0x000f).)",
    .next = "Set {bits} in the control word. The quick stop bit (bit 2) is active at 0.",
    .identity = "control_word"};

constexpr FindingKind kResetStands{
    .name = "reset-without-edge",
    .title =
        "Fault reset (bit 7) stays 1[{?solved} for {lasted_ms} before its rising edge]"
        "[{!solved}: no rising edge resets the fault]",
    .message =
        R"(Bit 7 of the control word ({control_word}) is 1 from {frame} on, for {lasted_ms}. Since then the drive
shows {state} (status word {status_word}, {shown_frame}).[ The drive reports {reason}.] A fault is reset by the
rising edge of bit 7, from 0 to 1.)",
    .next = "After the cause of the fault is corrected, send bit 7 as 0 for some cycles, then as 1.",
    .identity = "",
    .next_stays = true};

constexpr FindingKind kResetMissing{
    .name = "reset-missing",
    .title = "The master enables the drive in Fault without a fault reset[{?solved} for {lasted_ms}]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}, while the drive shows {state}
(status word {status_word}, {shown_frame}).[ The drive reports {reason}.] Bit 7 of the control word stays 0. A
drive leaves Fault only by the rising edge of bit 7.)",
    .next = "Reset the fault by the rising edge of bit 7 after its cause is corrected, then enable the drive.",
    .identity = "",
    .next_stays = true};

constexpr FindingKind kFaultStays{
    .name = "fault-stays",
    .title = "The fault stays[{?solved} for {lasted_ms}] after {resets}[: {reason}]",
    .message =
        R"(The master resets the fault ({resets}, the first at {frame}). {lasted_ms} later the drive still shows {state}
(status word {status_word}, {shown_frame}).[ The drive reports {reason}.][{!reason} The capture does not
show which fault it is.][{!solved} The cause is still there.])",
    .next =
        "[{?reason}Correct this cause.][{!reason}Read 603Fh and 1003h:1 from the drive and correct what they name.] "
        "Then reset the fault.",
    .identity = "reason"};

constexpr FindingKind kShutdownMissing{
    .name = "shutdown-missing",
    .title =
        "[{?solved}Shutdown (0x0006) comes only after {lasted_ms} of {control_word}]"
        "[{!solved}[{!sent_ms}Shutdown (0x0006) is missing before control word {control_word}]"
        "[Shutdown (0x0006) for {sent_ms} before {control_word}: drive did not follow]]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. The drive shows {state}
(status word {status_word}, {shown_frame}). The way from Switch on disabled to Operation enabled begins with
Shutdown: bits 1 and 2 are 1, bit 0 is 0.[ The master sent it for {sent_ms} before, and did not wait until the drive
showed Ready to switch on.])",
    .next =
        "Send 0x0006 until the drive shows Ready to switch on, then 0x0007, then 0x000f.[{?sent_ms} If it does not "
        "follow, check safe torque off (STO), the hardware enable input and the power supply of the motor.]",
    .identity = "control_word"};

constexpr FindingKind kNoVoltage{
    .name = "no-voltage",
    .title =
        "No voltage (status bit 4 = 0)[{?solved} for {lasted_ms}, then the drive is enabled]"
        "[{!solved}: the drive stays in {state}]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. The drive stays in {state},
and bit 4 (voltage enabled) of its status word {status_word} is 0 ({shown_frame}).)",
    .next = "Check the power supply of the motor, the hardware enable input and safe torque off.",
    .identity = "state"};

constexpr FindingKind kQuickStopStays{
    .name = "quick-stop-stays",
    .title = "Quick stop active is not left by {control_word}[{?solved} for {lasted_ms}]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. The drive stays in {state}
(status word {status_word}, {shown_frame}). Not every drive goes from Quick stop active to Operation enabled
(transition 16); 605Ah decides it.)",
    .next =
        "Send 0x0000 until the drive shows Switch on disabled, then 0x0006, 0x0007 and 0x000f. Or set 605Ah to 5 or "
        "more.",
    .identity = ""};

constexpr FindingKind kNotReady{
    .name = "not-ready",
    .title =
        "Not ready to switch on[{?solved} for {lasted_ms}][{?local}: local control (status bit 9 = 0)]"
        "[{!local}: the drive accepts no enable word]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. The drive shows {state}
(status word {status_word}, {shown_frame}) and accepts no command there.[{?local} Bit 9 (remote) is 0: the drive does
not act on the control word of the bus.])",
    .next =
        "[{?local}Select the fieldbus as the command source of the drive. ]Wait until the drive has come up. Check its "
        "logic supply, and whether the status word is mapped where it is read.",
    .identity = ""};

constexpr FindingKind kNotInOp{
    .name = "not-in-op",
    .title =
        "[{?solved}The master enables the drive {lasted_ms} before it requests OP]"
        "[{!solved}OP is [{?earlier}not requested again][{!earlier}never requested], but the master enables the drive]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. The slave is not in OP, and
the master did not request OP[{?earlier} again] up to {shown_frame}.[{?earlier} After OP it requested a lower
state.] Outputs act in OP only.)",
    .next = "Request OP, and send the enable sequence after AL Status shows OP.",
    .identity = ""};

constexpr FindingKind kOverwritten{
    .name = "control-word-overwritten",
    .title = "SDO control word {by_sdo} is overwritten by process data ({mapped})",
    .message =
        R"(The master wrote control word {by_sdo} by SDO in {frame}. The process data hold {mapped} for the same
object in every cycle. The drive shows {state} (status word {status_word}, {shown_frame}).)",
    .next = "Write the control word into the process data, or take it out of the PDO mapping.",
    .identity = "by_sdo mapped"};

constexpr FindingKind kLocal{
    .name = "local-control",
    .title =
        "Local control (status bit 9 = 0)[{?solved} for {lasted_ms}, then the drive is enabled]"
        "[{!solved}: the drive stays in {state}]",
    .message =
        R"(The master sends control word {control_word} from {frame} on, for {lasted_ms}. The drive stays in {state},
and bit 9 (remote) of its status word {status_word} is 0 ({shown_frame}): it does not act on the control word.)",
    .next = "Give the control to the fieldbus: close the commissioning software, and check the command source.",
    .identity = "state"};

constexpr FindingKind kStaysDisabled{
    .name = "stays-disabled",
    .title =
        "[{?solved}The drive stays in Switch on disabled for {lasted_ms} of enable words]"
        "[{!solved}Shutdown (0x0006) does not take the drive out of Switch on disabled][: {reason}]",
    .message =
        R"(The master sends Shutdown (0x0006) and the words after it. From {frame} on, for {lasted_ms}, the drive stays
in {state} (status word {status_word}, control word {control_word}, {shown_frame}).[{?no_voltage} Bit 4 (voltage
enabled) is 0.][{?local} Bit 9 (remote) is 0.][ The drive reports {reason}.])",
    .next =
        "[{?local}Give the control to the fieldbus. ]Check safe torque off (STO), the hardware enable input and the "
        "power supply of the motor, and read 603Fh.",
    .identity = ""};

constexpr FindingKind kNoSafety{
    .name = "fsoe-missing",
    .title =
        "[{?solved}The drive is not enabled for {lasted_ms}: FSoE is not in Data]"
        "[{!solved}[{!fsoe_state}No FSoE frame reaches the drive (E700h:1 = {fsoe_command}): STO may be active]"
        "[{?fsoe_state}FSoE of the drive stays in {fsoe_state} (E700h:1 = {fsoe_command}): STO may be active]]",
    .message =
        R"(The master asks for Operation enabled. From {frame} on, for {lasted_ms}, the drive shows {state} (status word
{status_word}, control word {control_word}, {shown_frame}). Its outputs hold an FSoE frame. The command of this frame
(E700h:1) is {fsoe_command}[{?fsoe_state} ({fsoe_state})][{!fsoe_state}, which is no FSoE command]. A drive with FSoE may
keep safe torque off (STO) active until its safety logic sends process data (0x36).)",
    .next =
        "Let the master copy the FSoE frames of safety logic and drive in each cycle, both ways. Then check the state "
        "of the FSoE connection in the safety logic.",
    .identity = "fsoe_command"};

constexpr FindingKind kSwapped{
    .name = "bytes-swapped",
    .title =
        "[{?padding}Control word {control_word} is written {padding} too late: a struct with padding]"
        "[{!padding}The bytes of control word {control_word} are swapped: 0x000f is meant]",
    .message =
        R"(From {frame} on, for {lasted_ms}, the control word is {control_word}, and 0x0600 or 0x0700 came before it.
Its low byte, with the bits that enable the drive, is 0. The drive shows {state} (status word {status_word},
{shown_frame}).[{?padding} That is {padding} after its place, where a C struct that is not packed has it: a shorter entry is mapped
before it.])",
    .next =
        "[{?padding}Pack the struct of the outputs, or copy each entry to its offset in the mapping.]"
        "[{!padding}Write the control word with its low byte first, at the offset where 6040h is mapped.]",
    .identity = ""};

constexpr FindingKind kHasty{
    .name = "hasty",
    .title = "Enable word taken back {times} before the drive follows",
    .message =
        R"(From {frame} to {shown_frame} bit 3 (enable operation) of the control word rises {times}. It is 0 again after
{longest_ms} at most. The drive does not show Operation enabled in this time (state {state}, status word
{status_word}).)",
    .next = "Wait for each state in the status word, and keep the control word until the drive shows it.",
    .identity = ""};

constexpr FindingKind kNoControlWord{
    .name = "no-control-word",
    .title = "6040h takes {values}: other data in its place",
    .message =
        R"(From {frame} on, for {lasted_ms}, the low byte of the control word takes {values}, last {control_word} in
{shown_frame}. The commands of CiA 402 need a dozen. The drive shows {state} (status word {status_word}).)",
    .next =
        "Compare the offset of the control word in the program of the master with the PDO mapping (1600h to 17FFh). "
        "Check what else writes to this place.",
    .identity = ""};

constexpr FindingKind kDipped{
    .name = "control-word-dipped",
    .title = "Control word {dip} for {dip_ms} stops the enabled drive",
    .message =
        R"(The drive shows Operation enabled when the control word becomes {dip} in {frame}. After {dip_ms} it is
{control_word} again. The drive obeyed: it shows {state} (status word {status_word}) for {lasted_ms} ({shown_frame}), and
the master sends no new enable sequence.)",
    .next =
        "Find what else writes the outputs for this time, or clears them. Then go through 0x0006, 0x0007 and 0x000f "
        "again whenever the status word does not show Operation enabled.",
    .identity = "dip"};

constexpr FindingKind kDropsBack{
    .name = "drops-back",
    .title = "Drive goes back to Switch on disabled {times} by itself",
    .message =
        R"(The drive goes back to Switch on disabled for the first time in {frame} and {times} up to {shown_frame}. The
control word (last {control_word}) asks for no such step: bits 1 and 2 are 1. The status word is {status_word}.)",
    .next =
        "Check the power supply of the motor, the enable input, safe torque off, and what the manual requires before "
        "Switch on.",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {
    &kBitMissing,     &kResetStands, &kResetMissing,  &kFaultStays,  &kShutdownMissing, &kNoVoltage,
    &kQuickStopStays, &kNotReady,    &kNotInOp,       &kOverwritten, &kLocal,           &kHasty,
    &kStaysDisabled,  &kSwapped,     &kNoControlWord, &kDipped,      &kDropsBack,       &kNoSafety};

constexpr NoteKind kEnabledLater{.name = "enabled-later", .text = "The drive shows Operation enabled in {frame}."};
constexpr const NoteKind* kNotes[] = {&kEnabledLater};

constexpr RuleInfo kInfo{.id = "drive-not-enabled",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "The master asks for Operation enabled and the drive does not get there",
                         .needs = "control word 6040h and status word 6041h with time stamps",
                         .source = "CIA402, state machine",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Whether an axis reaches Operation enabled when the master asks for it, and what is missing if it does not:

- a bit of the control word
- the rising edge of fault reset
- Shutdown before Enable operation
- the voltage
- OP
- control over the bus (bit 9 of the status word), and a master that waits for the drive
- a drive that goes back to Switch on disabled by itself, three times or more, or stays in it in spite of Shutdown
- FSoE frames: the outputs hold such a frame (E700h:1), and it is none with process data
- a control word that stops an enabled drive for at most 50 ms, and the drive that then stays disabled
- the bytes of the control word in the wrong order, or other data in its place (24 different values or more)
- an SDO write of the control word that process data overwrite

## Why it matters
The axis does not move. Each step of the master may be legal all the same.

## How it is decided
Bit 3 of the control word asks for Operation enabled if it rises while the drive is not enabled, or if it is set
when the slave comes to OP. A quick stop of an enabled drive is no such request, and neither is 0x0006. What no
drive can follow (a bit that is 0) counts after 200 ms, a missing edge or Shutdown after 500 ms, what a drive may be
slow in after 1 s. Attempts that the master gives up are added. A Shutdown of at least 50 ms counts as sent, and the
wait for the drive begins with it. A shorter one is named with its duration.

After a request for a state below OP, the master has to request OP again before it enables the drive.

A drive with FSoE may stay in its safe state until the safety logic sends it process data (command 0x36). 0 is no FSoE
command: then the master does not copy the frames of the safety logic.

If a fault was already active when first seen, and bit 7 stays 1, this finding is the cause of drive-fault: the fault
lasts because of it.

Bit 9 explains nothing if the drive followed a command of the capture with bit 9 at 0: then it does not use this bit.

If the drive shows Operation enabled after that, the finding is an info with its duration: a supply that comes up, or a
machine that waited. In a capture that begins mid-run the finding is inferred if the word was there from the start.

## Example
tests/rules/drive-not-enabled/violates.trace: control word 0x000b.

## What to do
The finding names what is missing. Correct this one thing first.
)"};

constexpr std::array kRows{
    AxisRule::Row{progress::AxisFact::kControlBitMissing, &kBitMissing},
    AxisRule::Row{progress::AxisFact::kResetStands, &kResetStands},
    AxisRule::Row{progress::AxisFact::kResetMissing, &kResetMissing},
    AxisRule::Row{progress::AxisFact::kFaultStays, &kFaultStays},
    AxisRule::Row{progress::AxisFact::kShutdownMissing, &kShutdownMissing},
    AxisRule::Row{progress::AxisFact::kNoVoltage, &kNoVoltage},
    AxisRule::Row{progress::AxisFact::kQuickStopStays, &kQuickStopStays},
    AxisRule::Row{progress::AxisFact::kNotReady, &kNotReady},
    AxisRule::Row{progress::AxisFact::kNotInOp, &kNotInOp},
    AxisRule::Row{progress::AxisFact::kOverwrittenControl, &kOverwritten},
    AxisRule::Row{progress::AxisFact::kLocalControl, &kLocal},
    AxisRule::Row{progress::AxisFact::kHasty, &kHasty},
    AxisRule::Row{progress::AxisFact::kStaysDisabled, &kStaysDisabled},
    AxisRule::Row{progress::AxisFact::kBytesSwapped, &kSwapped},
    AxisRule::Row{progress::AxisFact::kNoControlWord, &kNoControlWord},
    AxisRule::Row{progress::AxisFact::kDipped, &kDipped},
    AxisRule::Row{progress::AxisFact::kDropsBack, &kDropsBack},
};

constexpr std::uint8_t kSafetyData = 0x36;
/// Commands of FSoE before its process data, and the one for data that are no longer valid.
constexpr std::array<std::pair<std::uint8_t, Word>, 5> kSafetyCommands{{{0x2A, {"reset", "Reset"}},
                                                                        {0x4E, {"session", "Session"}},
                                                                        {0x64, {"connection", "Connection"}},
                                                                        {0x52, {"parameter", "Parameter"}},
                                                                        {0x08, {"fail-safe-data", "Fail-safe Data"}}}};

class DriveNotEnabled final : public AxisRule {
 public:
  DriveNotEnabled() : AxisRule(kInfo, kRows) {}

 private:
  /// What keeps a drive with FSoE disabled, unless its safety logic sends process data.
  [[nodiscard]] const FindingKind& KindOf(const progress::AxisRecord& record, const FindingKind& kind) const override {
    using progress::AxisFact;
    const bool waits = record.fact == AxisFact::kStaysDisabled || record.fact == AxisFact::kNoVoltage ||
                       (record.fact == AxisFact::kShutdownMissing && record.b > 0);
    return waits && record.safety_command.value_or(kSafetyData) != kSafetyData ? kNoSafety : kind;
  }

  static void DescribeSafety(Finding& finding, const progress::AxisRecord& record) {
    finding.Set("fsoe_command", arg::Hex(*record.safety_command, 2));
    for (const auto& [command, name] : kSafetyCommands) {
      if (command == *record.safety_command) finding.Set("fsoe_state", arg::Of(name));
    }
  }

  void Describe(Finding& finding, const progress::AxisRecord& record, const progress::AxisWatch& axis) override {
    if (record.solved) {
      finding.Set("solved", arg::Flag());
      Arguments later;
      later.Set("frame", arg::Frame(record.solved_at.number));
      finding.Add(kEnabledLater, std::move(later));
      AddRelated(finding, record.solved_at.number);
    }
    if (finding.kind == &kNoSafety) return DescribeSafety(finding, record);
    switch (record.fact) {
      case progress::AxisFact::kControlBitMissing: {
        std::size_t count = 0;
        std::string bits;
        for (std::size_t bit = 0; bit < kBits.size(); ++bit) {
          if ((record.a >> bit & 1) == 0) continue;
          bits += (count++ == 0 ? "" : ", ") + std::string(kBits.at(bit));
        }
        finding.Set("bits", arg::Text(bits)).Set("bit_count", arg::Number(static_cast<std::int64_t>(count)));
        return;
      }
      case progress::AxisFact::kShutdownMissing:
        if (record.b > 0) finding.Set("sent_ms", arg::Ms(record.b));
        return;
      case progress::AxisFact::kNotInOp:
        if (record.a != 0) finding.Set("earlier", arg::Flag());
        return;
      case progress::AxisFact::kNotReady:
      case progress::AxisFact::kStaysDisabled:
        // 0 may mean that no inputs were valid yet.
        if (record.status.value_or(0) == 0) return;
        if (axis.enable().IsLocal(*record.status)) finding.Set("local", arg::Flag());
        if ((*record.status >> progress::kVoltageBit & 1U) == 0) finding.Set("no_voltage", arg::Flag());
        return;
      case progress::AxisFact::kFaultStays:
        finding.Set("resets", arg::Count(static_cast<std::uint64_t>(record.a), "reset"));
        return;
      case progress::AxisFact::kBytesSwapped:
        if (PaddingBefore(kControlWord) == 1) finding.Set("padding", arg::Count(1, "byte"));
        return;
      case progress::AxisFact::kHasty:
        finding.Set("times", arg::Count(static_cast<std::uint64_t>(record.a), "time"));
        finding.Set("longest_ms", arg::Ms(record.b));
        return;
      case progress::AxisFact::kNoControlWord:
        finding.Set("values", arg::Count(static_cast<std::uint64_t>(record.a), "different value"));
        return;
      case progress::AxisFact::kDipped:
        finding.Set("dip", arg::Hex(static_cast<std::uint64_t>(record.a))).Set("dip_ms", arg::Ms(record.b));
        return;
      case progress::AxisFact::kDropsBack:
        finding.Set("times", arg::Count(static_cast<std::uint64_t>(record.a), "time"));
        return;
      case progress::AxisFact::kOverwrittenControl:
        finding.Set("by_sdo", arg::Hex(static_cast<std::uint64_t>(record.a)))
            .Set("mapped", arg::Hex(static_cast<std::uint64_t>(record.b)));
        return;
      default:
        return;
    }
  }

  static constexpr std::uint16_t kControlWord = 0x6040;
  static constexpr std::array<std::string_view, 3> kBits{"switch on (bit 0)", "enable voltage (bit 1)",
                                                         "quick stop (bit 2)"};
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveNotEnabled>};

}  // namespace
}  // namespace ecaudit::drive_not_enabled
