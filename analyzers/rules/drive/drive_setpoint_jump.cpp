#include <algorithm>
#include <array>
#include <cstdint>

#include "analyzers/judge/axis_lead.h"
#include "analyzers/judge/axis_rule.h"

namespace ecaudit::drive_setpoint_jump {
namespace {

constexpr FindingKind kAtEnable{
    .name = "jump-at-enable",
    .title =
        "[{?padding}Target position is written {padding} too late: a struct with padding]"
        "[{!padding}[{?new_mode}Mode change][{!new_mode}Enabled] with target position {target}, actual value {actual}]",
    .message =
        R"(When the [{?new_mode}mode changes][{!new_mode}drive is enabled] ({frame}) the target position (607Ah) is {target} and the position actual value
(6064h) is {actual}.[ The target is the actual value, moved by {padding}. There a C struct that is
not packed has it, because a shorter entry is mapped before it.] After that the target [{?constant}does not change][{!constant}changes by at most
{step} in a cycle].[{?fault} The drive shows status
word {status_word} in {shown_frame}.][{!fault} The axis runs to the target: up to {shown_frame} it makes a fifth
of the way.] In {mode} the target has to start at the actual value.)",
    .next =
        "[{?padding}Pack the struct of the outputs, or copy each entry to its offset in the mapping.]"
        "[{!padding}Copy the position actual value (6064h) into the target position (607Ah) in each cycle until "
        "[{?new_mode}6061h shows the new mode][{!new_mode}Operation enabled is shown].]",
    .identity = ""};

constexpr FindingKind kJump{
    .name = "jump",
    .title = "Target position jumps from {from} to {target}",
    .message =
        R"(In {frame} the target position (607Ah) goes from {from} to {target} in one cycle; before, it changed by at
most {step} in a cycle. The drive then shows status word {status_word} ({shown_frame})[ and reports {reason}].)",
    .next = "Limit the change of the target in a cycle to what the axis can do, also after a change of the trajectory.",
    .identity = ""};

constexpr FindingKind kSpike{
    .name = "target-spike",
    .title = "Target position is {target} for {lasted_ms}, then near {from} again",
    .message =
        R"(In {frame} the target position (607Ah) goes from {from} to {target} in one cycle, and back in {shown_frame},
{lasted_ms} later. Otherwise it changes by at most {step} in a cycle. In mode {mode} the drive starts to move there.)",
    .next =
        "Find what writes the outputs in between: a buffer that is cleared or written by two tasks, or data that are "
        "copied while they are sent.",
    .identity = ""};

constexpr FindingKind kEcho{
    .name = "target-repeats-actual",
    .title = "The target position only repeats the position actual value",
    .message =
        R"(From {frame} to {shown_frame} ({lasted_ms}) the target position (607Ah) is the actual value (6064h) of the
cycle before, in {changes}. The drive is enabled, and the axis moves by {travel} in between. Such a target gives the
drive no position to hold. It is right only if the axis is moved by hand.)",
    .next =
        "Stop copying the actual value into the target when the drive is enabled, and continue from the last target.",
    .identity = ""};

constexpr FindingKind kAlternates{
    .name = "alternates",
    .title = "Target position goes back and forth between two values ({times})",
    .message =
        R"(From {frame} on the target position (607Ah) changes to a far value and back: {times} in {lasted_ms}, last from
{from} to {target} ({shown_frame}). The position actual value follows neither step.)",
    .next = "Check whether two parts of the master's program send process data, or write to two copies of the outputs.",
    .identity = ""};

constexpr FindingKind kUneven{
    .name = "target-uneven",
    .title = "Target position is late in {share} of the cycles in motion",
    .message =
        R"(In {late} of {cycles} in motion from {frame} on, the target position (607Ah) is the same as in the cycle before.
Then it makes up for that by a larger step ({made_up}). In mode {mode} the drive moves by the difference of two targets
in each cycle: the axis stops and runs, with noise or vibration.)",
    .next =
        "Compute the target in the task that sends the process data, once in each cycle, or let both run with one "
        "clock.",
    .identity = ""};

constexpr FindingKind kSlow{
    .name = "target-slow",
    .title = "Target position changes only in 1 of {cycles_apart} cycles",
    .message =
        R"(In {late} of {cycles} in motion from {frame} on, the target position (607Ah) is the same as in the cycle before.
A drive in mode {mode} that does not interpolate over this time moves in steps.)",
    .next = "Compute a target for each cycle, or set the interpolation time (60C2h) to the time between two targets.",
    .identity = ""};

constexpr FindingKind kOutside{
    .name = "outside-limits",
    .title = "Target position {target} is beyond the software limit {limit} (607Dh)",
    .message =
        R"(The target position (607Ah) is {target} from {frame} on, for {lasted_ms} ({shown_frame}). The software
position limit (607Dh) in the capture is {limit}.[{?followed} The axis goes there all the same: its position actual
value is {actual}.][{?standing} The position actual value is {actual}.][{?unseen} The position actual value is not in
the capture.])",
    .next =
        "[{?followed}Check the unit of 607Dh, and whether the drive uses it before homing.]"
        "[{!followed}Change the target, or the limits in 607Dh.]",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {&kAtEnable,   &kJump,   &kSpike, &kEcho,
                                         &kAlternates, &kUneven, &kSlow,  &kOutside};

constexpr const NoteKind* kNotes[] = {&kLeadNote};

constexpr RuleInfo kInfo{.id = "drive-setpoint-jump",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "The target position is one that the axis cannot or should not follow",
                         .needs = "607Ah and 6064h in the process data, cyclic synchronous position, time stamps",
                         .source = "CIA402, cyclic synchronous position",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
In cyclic synchronous position: whether the target position (607Ah) starts at the position actual value (6064h), when
the drive is enabled or this mode begins,
does not jump or alternate, is no echo of the actual value, and lies inside the software limits (607Dh).

## Why it matters
The axis runs to a wrong target at full speed, or stops with a following error.

## How it is decided
A jump is more than 50 times what the target changes in a cycle otherwise, at least 500 increments, and something
comes of it within 500 ms: the axis comes a fifth nearer, the drive faults or shows a following error.

A target that is the actual value moved by whole bytes shows a struct with padding in the master: a C compiler puts a
32 bit entry at a multiple of 4 bytes, the mapping does not. The bytes have to be those that the mapping needs.

An echo is a target that equals the actual value of the cycle before in 50 changes in a row, over at least 500 ms,
while the axis moves. A change of its speed has to be among them. It is inferred: an axis may be moved by hand on
purpose.

A spike is such a jump that the target takes back within 3 cycles and 50 ms, and no other for 20 cycles. It needs no
consequence. The control word has to ask for Operation enabled at the same time.

A target alternates if it makes a step of at least 500 increments and comes back in its next change, 50 times in a row
over at least 250 ms, and the axis follows by less than an eighth.

A target is late if it stays the same for 1 to 20 cycles between two steps of one direction, each at least 10
increments. It is uneven if that makes 1 in 20 of the cycles in motion, at least 50 times, and half of the steps after
it are larger than the one before by half. If hardly any two steps follow each other without such a cycle, the target
is slower than the cycle: an info, because the drive may interpolate.

Limits count if they were read or written by SDO, and the target is at least 500 increments beyond them. If only one of
them is in the capture, it has to be other than 0. An axis that was beyond it before rests there, until the target goes
by 500 increments. If the axis goes with its target beyond them, or 6064h is not in the capture, the finding is an info.

## Example
tests/rules/drive-setpoint-jump/violates.trace: the target is 0 when the drive is enabled.

## What to do
Let the target follow the actual value until the drive shows Operation enabled, and start each motion from there.
)"};

constexpr std::array kRows{
    AxisRule::Row{progress::AxisFact::kJumpAtEnable, &kAtEnable},
    AxisRule::Row{progress::AxisFact::kJumpInOperation, &kJump},
    AxisRule::Row{progress::AxisFact::kTargetSpike, &kSpike},
    AxisRule::Row{progress::AxisFact::kTargetEchoes, &kEcho},
    AxisRule::Row{progress::AxisFact::kTargetAlternates, &kAlternates},
    AxisRule::Row{progress::AxisFact::kTargetUneven, &kUneven},
    AxisRule::Row{progress::AxisFact::kTargetSlow, &kSlow},
    AxisRule::Row{progress::AxisFact::kOutsideLimits, &kOutside},
};

constexpr std::uint16_t kTargetPosition = 0x607A;

/// Whether the target has the actual value in its upper bytes, and the padding, which is 0, in its lower ones.
bool IsMoved(std::int64_t target, std::int64_t actual, std::uint32_t padding) {
  constexpr std::int64_t kNear = 64;  // the axis moves a little until the target is there
  constexpr std::int64_t kNotByChance = 16 * kNear;
  if (padding == 0 || padding > 2) return false;
  const std::int64_t factor = std::int64_t{1} << (8 * padding);
  const std::int64_t range = std::int64_t{1} << (32 - 8 * padding);
  if (target % factor != 0) return false;
  const auto wrapped = [range](std::int64_t value) { return ((value % range) + range) % range; };
  const std::int64_t value = wrapped(actual);
  if (value < kNotByChance || range - value < kNotByChance) return false;
  const std::int64_t apart = wrapped(target / factor - actual);
  return std::min(apart, range - apart) <= kNear;
}

class DriveSetpointJump final : public AxisRule {
 public:
  DriveSetpointJump() : AxisRule(kInfo, kRows) {}

 private:
  static void DescribeRhythm(Finding& finding, const progress::AxisRecord& record) {
    const double share = 100.0 * static_cast<double>(record.b) / static_cast<double>(record.a);
    finding.Set("late", arg::Count(static_cast<std::uint64_t>(record.b), "cycle"))
        .Set("cycles", arg::Count(static_cast<std::uint64_t>(record.a), "cycle"))
        .Set("share", arg::Real(share, "%", share < 10 ? 1 : 0));
    if (record.fact == progress::AxisFact::kTargetUneven) {
      finding.Set("made_up", arg::Count(static_cast<std::uint64_t>(record.c), "time"));
    } else {
      finding.Set("cycles_apart", arg::Number(record.c));
    }
  }

  void Describe(Finding& finding, const progress::AxisRecord& record, const progress::AxisWatch&) override {
    switch (record.fact) {
      case progress::AxisFact::kJumpAtEnable:
        finding.Set("target", arg::Number(record.a)).Set("actual", arg::Number(record.b));
        finding.Set("step", arg::Number(record.c)).Set("constant", arg::Flag(record.c == 0));
        if (record.new_mode) finding.Set("new_mode", arg::Flag());
        if (const std::uint32_t padding = PaddingBefore(kTargetPosition); IsMoved(record.a, record.b, padding)) {
          finding.Set("padding", arg::Count(padding, "byte"));
        }
        return;
      case progress::AxisFact::kJumpInOperation:
        finding.Set("from", arg::Number(record.a)).Set("target", arg::Number(record.b));
        finding.Set("step", arg::Number(record.c));
        return;
      case progress::AxisFact::kTargetSpike:
        finding.Set("from", arg::Number(record.a)).Set("target", arg::Number(record.b));
        finding.Set("step", arg::Number(record.c));
        return;
      case progress::AxisFact::kTargetEchoes:
        finding.Set("changes", arg::Count(static_cast<std::uint64_t>(record.a), "change"));
        finding.Set("travel", arg::Number(record.b));
        return;
      case progress::AxisFact::kTargetAlternates:
        finding.Set("from", arg::Number(record.a)).Set("target", arg::Number(record.b));
        finding.Set("times", arg::Count(static_cast<std::uint64_t>(record.c), "time"));
        return;
      case progress::AxisFact::kTargetUneven:
      case progress::AxisFact::kTargetSlow:
        DescribeRhythm(finding, record);
        return;
      default:
        finding.Set("target", arg::Number(record.a)).Set("limit", arg::Number(record.b));
        if (record.followed || !record.healthy) finding.Set("actual", arg::Number(record.c));
        finding.Set(record.followed ? "followed" : record.healthy ? "unseen" : "standing", arg::Flag());
        return;
    }
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveSetpointJump>};

}  // namespace
}  // namespace ecaudit::drive_setpoint_jump
