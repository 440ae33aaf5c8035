#include <array>

#include "analyzers/judge/axis_lead.h"
#include "analyzers/judge/axis_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/network.h"

namespace ecaudit::drive_not_following {
namespace {

constexpr FindingKind kFollowingError{
    .name = "following-error",
    .title = "Following error (status bit 13) while the drive is enabled",
    .message =
        R"(Bit 13 of the status word {status_word} is 1 from {frame} on ({shown_frame}), in mode {mode}. The drive
cannot follow its set point.[ Target {target}, actual value {actual}.])",
    .next =
        "Compare the change of the target in a cycle with what the axis can do; check the following error window "
        "(6065h), load, brake and scaling.",
    .identity = ""};

constexpr FindingKind kHomingError{
    .name = "homing-error",
    .title = "Homing error (status bit 13)",
    .message =
        R"(Bit 13 of the status word {status_word} is 1 from {frame} on ({shown_frame}), in mode {mode}: the homing
procedure failed.)",
    .next = "Check the homing method (6098h), the switches that it needs, speeds (6099h) and limits.",
    .identity = ""};

constexpr FindingKind kStandsStill{
    .name = "stands-still",
    .title =
        R"([{?solved_frame}The axis follows its {quantity} set point only after {lasted_ms}][{!solved_frame}[{?halted}Halt
(bit 8) is 1 while the {quantity} set point asks for motion][{!halted}[{?switch}The {switch} limit switch (60FDh) is
active: the axis stands still][{!switch}[{?sync_off}SYNC0 is off, and the axis does not follow its {quantity} set
point][{!sync_off}The axis stands still while its {quantity} set point asks for motion]]]])",
    .message =
        R"(From {frame} on, for {lasted_ms}, the [{?velocity}target velocity is {set_point} and the velocity actual
value {actual_value}][{?torque}target torque is {set_point} and the torque actual value {actual_value}][{?position}target
position goes by {set_point} and the position actual value by {actual_value}] ({shown_frame}). The drive shows {state}
(status word {status_word}), mode {mode}.[{?limited} Bit 11 shows that an internal limit is active.][ Bit {switch_bit} of
60FDh shows that the {switch} limit switch is active.][{?sync_off} The mode is a cyclic synchronous one, and no SYNC0
comes (0x0981 is {activation}).][{?sync1_off} SYNC0 is on, and SYNC1 is off (0x0981 is {activation}): some drives need
both.][ The axis followed the same set point from {solved_frame} on.])",
    .next =
        R"([{?solved_frame}Check the release of brake and drive, if this delay is not intended.][{!solved_frame}[{?halted}Clear
bit 8 of the control word ({control_word}).][{!halted}[{?switch}Move the axis off the {switch} limit switch in the
other direction, or check its wiring and polarity.][{!switch}Check brake, torque limit (6072h) and [{?velocity}halt (bit
8)][{!velocity}limit switches], whether the drive uses this set point in its mode, and scaling.][{?sync_off} Set up
distributed clocks and switch SYNC0 on (0x0981) if the drive follows cyclic set points only with it.][{?sync1_off}
Compare 0x0981 with AssignActivate of the ESI (0x0700 is SYNC0 and SYNC1).]]])",
    .identity = "quantity"};

constexpr FindingKind kLags{
    .name = "falls-behind",
    .title =
        "[{?rests}The axis rests after {actual_value} of {set_point} increments: check scaling]"
        "[{!rests}The axis lags: {actual_value} of {set_point} increments]",
    .message =
        R"(From {frame} on, for {lasted_ms}, the target position goes by {set_point} and the position actual value by
{actual_value} ({shown_frame}). The drive shows {state} (status word {status_word}), mode {mode}.[{?limited} Bit
11 shows that an internal limit is active.][{?rests} Then both rest, and the axis does not make the rest of the way. The
status word shows neither a limit nor a following error. So the drive may be where it was sent, and the two values in
different units.])",
    .next =
        "[{?rests}Compare the units of target and actual value: encoder resolution (608Fh), gear ratio (6091h) and "
        "feed constant (6092h).]"
        "[{!rests}Check speed limit (6080h, 607Fh), torque limit (6072h) and the scaling of both values (gear ratio, "
        "6091h, 6092h).]",
    .identity = ""};

constexpr FindingKind kWrongWay{
    .name = "wrong-way",
    .title = "The axis moves against its {quantity} set point",
    .message =
        R"(From {frame} on, for {lasted_ms}, the [{?velocity}target velocity is {set_point} and the velocity actual
value {actual_value}][{!velocity}target position goes by {set_point} and the position actual value by {actual_value}]
({shown_frame}). The drive shows {state} (status word {status_word}), mode {mode}.[{?limited} Bit 11 shows that an
internal limit is active.])",
    .next = "Check the polarity (607Eh) and the direction of motor and encoder.",
    .identity = "quantity"};

constexpr FindingKind kZeroLimit{
    .name = "limit-zero",
    .title = "{limit:number} is 0[{!by_sdo} in the process data]: the axis stands still",
    .message =
        R"(From {frame} on, for {lasted_ms}, the {quantity} set point is not followed: it is or goes by {set_point}, the
actual value {actual_value} ({shown_frame}). [{?by_sdo}By SDO, {limit} is 0][{!by_sdo}The master sends {limit} = 0 in the
process data], and a drive with this limit at 0 does not move. The drive shows {state} (status word {status_word}), mode
{mode}.)",
    .next =
        "[{?by_sdo}Write a value to {limit:number} before the drive is enabled.]"
        "[{!by_sdo}Send a value for {limit:number} in each cycle, or take it out of the PDO mapping.]",
    .identity = "limit"};

constexpr FindingKind kOtherScale{
    .name = "other-scaling",
    .title = "Velocity actual value {actual_value} for a target velocity of {set_point}",
    .message =
        R"(From {frame} on, for {lasted_ms}, the target velocity is {set_point} and the velocity actual value
{actual_value} ({shown_frame}). The actual value is not near 0, so the axis may turn, and the two values may be in
different units.[ By the manual the actual value is in {unit}.] The position actual value (6064h) is not in the
capture.)",
    .next = "Compare the units of target and actual velocity in the manual, and map 6064h.",
    .identity = ""};

constexpr FindingKind kHomingStands{
    .name = "homing-stands-still",
    .title =
        "[{?solved_frame}Homing took more than {lasted_ms} without a visible motion]"
        "[{!solved_frame}[{limit:number} is 0: homing][{!limit}Homing] is started (bit 4), but the axis does not move]",
    .message =
        R"(Bit 4 of the control word ({control_word}) starts homing in {frame}. For {lasted_ms} the position actual
value changes by no more than {travel} ({shown_frame}). The status word {status_word} shows neither homing attained
(bit 12) nor an error (bit 13).[ In {solved_frame} bit 12 shows that homing is attained.])",
    .next =
        R"([{?solved_frame}Check the speeds (6099h) and the release of the brake, if this delay is not
intended.][{!solved_frame}[Write a value to {limit:number}. ]Check the homing method (6098h), the speeds (6099h) and the
acceleration (609Ah): a speed of 0 does not move.])",
    .identity = ""};

constexpr FindingKind kHomingCut{
    .name = "homing-cut-short",
    .title = "Homing is cut short: another mode before it is attained (bit 12)",
    .message =
        R"(Bit 4 of the control word starts homing in {frame}. In {shown_frame}, {lasted_ms} later, the drive shows mode
{mode}. The axis was in motion up to then ({travel} from the start). The status word never showed homing attained (bit
12) nor an error (bit 13). So this homing gives the axis no reference.)",
    .next = "Keep mode 6 and bit 4 until bit 12 of the status word is 1, and then select the next mode.",
    .identity = "mode"};

constexpr FindingKind kHomingRuns{
    .name = "homing-runs",
    .title = "Homing moves the axis for {lasted_ms} and shows no end",
    .message =
        R"(Bit 4 of the control word ({control_word}) starts homing in {frame}. The axis moves for {lasted_ms}. In
{shown_frame} it is {travel} from the start. The status word never shows homing attained (bit 12) nor an error
(bit 13).)",
    .next = "If it goes on, check that the switch of the homing method (6098h) is wired to the drive and reached.",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {&kFollowingError, &kHomingError, &kStandsStill,  &kLags,      &kWrongWay,
                                         &kZeroLimit,      &kOtherScale,  &kHomingStands, &kHomingCut, &kHomingRuns};

constexpr const NoteKind* kNotes[] = {&kLeadNote};

constexpr RuleInfo kInfo{.id = "drive-not-following",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "The actual value does not go where the set point goes",
                         .needs = "status word, mode, set point and actual value in the process data; time stamps",
                         .source = "CIA402, status word and modes of operation",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Whether an enabled axis follows its set point: following error and homing error (bit 13 of the status word), and the
actual value against the set point in position and velocity modes.

## Why it matters
The drive is enabled and commanded, and the axis is not where the master thinks that it is.

## How it is decided
- Bit 13 counts in the modes that define it: profile position, cyclic synchronous position, homing. If the manual of
  the family gives it another meaning, device-fault-bit reports it.
- A cyclic target position goes by at least 500 increments for 500 ms. The actual value makes less than a twentieth
  (stands still), less than half (lags), or goes the other way.
- Profile position: after the start the axis makes less than a twentieth of the way and does not move for 1 s.
- A velocity of which the drive shows less than a twentieth, or the other sign, and which does not come nearer to its
  target for 1 s. A ramp comes nearer. 60FFh is compared with 606Ch, 6042h with 6044h.
- A target torque of at least 50 of which the drive shows less than a twentieth for 1 s, while the position does not
  move.
- A limit that is 0, in the process data or by SDO, is named as the cause: 6072h, 60E0h, 60E1h, 607Fh, 6080h, 6081h,
  6083h, in homing 6098h, 6099h:1 and 609Ah. So is a limit switch that 60FDh shows where the axis is to go.
- Halt in a profile mode is no violation, and neither are bits 4 to 6 in velocity mode (2) if they are not all 1.
- An axis whose position moves does not stand still, whatever its velocity shows. If the position is not in the
  capture, a steady velocity other than 0 is an inferred info, and so is one that always has the sign of its target:
  the two values may be in different units.
- An axis that lags is scaled in another way if it then rests together with its target for 200 ms, without the rest of
  the way, and the status word shows neither an internal limit nor a following error.
- In homing an axis moves that makes 2 steps or more, all of them one way.
- Homing is cut short if the drive stays enabled and shows another mode while the axis moves, before bit 12 or 13. An
  axis that halt or bit 4 stopped before does not count.
- Homing that moves the axis for 10 s, and shows no end before the capture ends, is an info: a long axis may need it.
- If the axis then follows the same start (profile position, homing) or set point (profile velocity, velocity mode),
  the finding is an info with its duration: a brake, a release.
- A velocity with an active internal limit (bit 11 of the status word) is an info: a winder or a clamp works so.

If the axis follows another command later, the finding stays, and the capture passes.

## Example
tests/rules/drive-not-following/violates.trace: the axis stands still.

## What to do
Look at both values over time: `ecaudit signals --around FRAME`.
)"};

constexpr std::array kRows{
    AxisRule::Row{progress::AxisFact::kFollowingError, &kFollowingError},
    AxisRule::Row{progress::AxisFact::kHomingError, &kHomingError},
    AxisRule::Row{progress::AxisFact::kStandsStill, &kStandsStill},
    AxisRule::Row{progress::AxisFact::kLags, &kLags},
    AxisRule::Row{progress::AxisFact::kWrongWay, &kWrongWay},
    AxisRule::Row{progress::AxisFact::kZeroLimit, &kZeroLimit},
    AxisRule::Row{progress::AxisFact::kOtherScale, &kOtherScale},
    AxisRule::Row{progress::AxisFact::kHomingStands, &kHomingStands},
    AxisRule::Row{progress::AxisFact::kHomingCut, &kHomingCut},
    AxisRule::Row{progress::AxisFact::kHomingRuns, &kHomingRuns},
};

constexpr Word kPosition{"position", "position"};
constexpr Word kVelocity{"velocity", "velocity"};
constexpr Word kTorque{"torque", "torque"};
constexpr Word kPositive{"positive", "positive"};
constexpr Word kNegative{"negative", "negative"};

class DriveNotFollowing final : public AxisRule {
 public:
  DriveNotFollowing() : AxisRule(kInfo, kRows) {}

 private:
  void Describe(Finding& finding, const progress::AxisRecord& record, const progress::AxisWatch& axis) override {
    if (record.fact == progress::AxisFact::kFollowingError || record.fact == progress::AxisFact::kHomingError) {
      const progress::AxisView& now = axis.now();
      if (now.Target(progress::Quantity::kPosition) && now.Actual(progress::Quantity::kPosition)) {
        finding.Set("target", arg::Number(record.a)).Set("actual", arg::Number(record.b));
      }
      return;
    }
    if (record.fact == progress::AxisFact::kHomingCut || record.fact == progress::AxisFact::kHomingRuns) {
      finding.Set("travel", arg::Number(progress::Magnitude(record.b)));
      return;
    }
    if (record.healthy && record.solved_at.seen()) {
      finding.Set("solved_frame", arg::Frame(record.solved_at.number));
      AddRelated(finding, record.solved_at.number);
    }
    if (record.fact == progress::AxisFact::kHomingStands) {
      finding.Set("travel", arg::Number(progress::Magnitude(record.b)));
      if (record.c != 0) finding.Set("limit", ObjectOf(record.c));
      return;
    }
    if (record.control && (*record.control >> progress::kHaltBit & 1U) != 0) finding.Set("halted", arg::Flag());
    const bool velocity = record.quantity == progress::Quantity::kVelocity;
    const bool torque = record.quantity == progress::Quantity::kTorque;
    finding.Set("quantity", arg::Of(velocity ? kVelocity : torque ? kTorque : kPosition));
    finding.Set(velocity ? "velocity" : torque ? "torque" : "position", arg::Flag());
    if (record.at_switch != 0) {
      const bool positive = record.at_switch == progress::kPositiveSwitch;
      finding.Set("switch", arg::Of(positive ? kPositive : kNegative)).Set("switch_bit", arg::Number(positive ? 1 : 0));
    }
    if (record.by_sdo) finding.Set("by_sdo", arg::Flag());
    if (record.rests) finding.Set("rests", arg::Flag());
    NameSync(finding, record);
    if (record.fact == progress::AxisFact::kZeroLimit) finding.Set("limit", ObjectOf(record.c));
    if (record.fact == progress::AxisFact::kOtherScale) {
      const bool speed = record.mode && progress::QuantityOf(*record.mode) == progress::Quantity::kSpeed;
      const std::string unit = UnitOf(progress::ObjectOf(speed ? progress::Role::kSpeed : progress::Role::kVelocity));
      if (!unit.empty()) finding.Set("unit", arg::Text(unit));
    }
    finding.Set("set_point", arg::Number(record.a)).Set("actual_value", arg::Number(record.b));
  }

  /// Some drives follow the set points of the cyclic modes only with SYNC0, or only with SYNC1.
  void NameSync(Finding& finding, const progress::AxisRecord& record) const {
    if (record.fact != progress::AxisFact::kStandsStill || record.mode.value_or(0) < progress::kInterpolated) return;
    finding.Set("cyclic", arg::Flag());
    const sync::DcUnit& unit = context().sync().dc(finding.slave);
    if (!unit.activation() || !HasClock(finding.slave)) return;
    if (unit.activation_changed() > finding.first.number) return;  // it was another one when the axis stopped
    const esc::SyncActivation activation = *unit.activation();
    if (activation.active() && activation.sync1()) return;
    finding.Set("activation", arg::Hex(activation.raw, 2));
    finding.Set(activation.active() && activation.sync0() ? "sync1_off" : "sync_off", arg::Flag());
  }

  /// Unless the slave shows that it has none.
  [[nodiscard]] bool HasClock(SlaveId slave) const {
    const auto features = context().network().state(slave).registers.Value<std::uint8_t>(esc::kEscFeatures);
    return !features || esc::HasClock(*features);
  }

  [[nodiscard]] std::optional<Reason> Unevaluated(const progress::AxisWatch& axis) const override {
    if (!axis.command().commanded().seen() || axis.follow().follows().seen()) return std::nullopt;
    const progress::AxisView& now = axis.now();
    if (!now.mode()) return Reason::Of(ReasonCode::kNotInCapture, what::kMode);
    const auto quantity = progress::QuantityOf(*now.mode());
    if (quantity == progress::Quantity::kNone || quantity == progress::Quantity::kTorque) return std::nullopt;
    if (!now.Actual(quantity)) return Reason::Of(ReasonCode::kNotInCapture, kActual);
    return std::nullopt;
  }

  static constexpr Word kActual{"actual-value", "the actual value of the axis (6064h, 606Ch, 6044h)"};
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveNotFollowing>};

}  // namespace
}  // namespace ecaudit::drive_not_following
