#include <map>
#include <utility>
#include <vector>

#include "analyzers/judge/operation_modes.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/esc/al.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/network.h"

namespace ecaudit::sync_not_activated {
namespace {

constexpr FindingKind kReached{
    .name = "op-without-sync0",
    .title = "OP reached with a SYNC0 cycle, but SYNC0 is off (0x0981 = {activation})",
    .message =
        R"(The master wrote a SYNC0 cycle (0x09A0) for this slave in {cycle_frame}. When {frame} shows OP, 0x0981 is
{activation}. So the slave generates no SYNC0 and is not synchronised to the other axes.)",
    .next = "Switch SYNC0 on after start time and cycle (0x0981 = 3), or leave the cycle 0."};

constexpr FindingKind kRefused{
    .name = "refused-without-sync0",
    .title = "OP refused: SYNC0 has a cycle, but is off (0x0981 = {activation})",
    .message = R"(The master wrote a SYNC0 cycle (0x09A0) for this slave in {cycle_frame}. When the slave refuses OP in
{frame}, 0x0981 is {activation}. So the slave generates no SYNC0, and reports that it sees none (AL status code
0x002d).)",
    .next = "Switch SYNC0 on after start time and cycle (0x0981 = 3), or leave the cycle 0."};

constexpr FindingKind kOtherCycle{
    .name = "cycle-not-offered",
    .title = "SYNC0 cycle of {sync0_cycle_ns} is in no operation mode of the {mode_source}",
    .message = R"(When {frame} shows OP, 0x0981 is {activation} with a SYNC0 cycle of {sync0_cycle_ns}
({activation_frame}). The {mode_source} of the device offers these values of 0x0981: {offered}[ and {more}].)",
    .next = "Choose one of these operation modes in the configuration of the master."};

constexpr FindingKind kOtherActivation{
    .name = "activation-not-offered",
    .title = "Activation 0x0981 = {activation} is in no operation mode of the {mode_source}",
    .message = R"(When {frame} shows OP, 0x0981 is {activation}[ with a SYNC0 cycle of {sync0_cycle_ns}]
({activation_frame}). The {mode_source} of the device offers these values of 0x0981: {offered}[ and {more}].)",
    .next = "Choose one of these operation modes in the configuration of the master."};

constexpr FindingKind kNoClock{
    .name = "no-clock",
    .title = "SYNC0 activated (0x0981 = {activation}), but the slave has no clock",
    .message = R"(The master writes {activation} to 0x0981 in {write_frame}, and the slave does not accept it (working
counter 0). By bit 2 of its features (0x0008) the slave controller has no distributed clocks. In {frame} the slave
[{?refused}refuses][{!refused}reaches] {requested}, without SYNC0.)",
    .next = "Switch distributed clocks off for this slave, or use one that has them."};

constexpr const FindingKind* kKinds[] = {&kReached, &kRefused, &kOtherCycle, &kOtherActivation, &kNoClock};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sync-lost"};

constexpr RuleInfo kInfo{.id = "sync-not-activated",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .subject = Subject::kClock,
                         .title = "A SYNC0 cycle is configured, but SYNC0 is off in OP",
                         .needs = "writes of 0x09A0 and 0x0981 of the slave, AL Status OP",
                         .source = "ESC-1, distributed clocks, SYNC signal generation; ETG2000, Dc/OpMode",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
A slave has a SYNC0 cycle (0x09A0), but its cyclic operation (0x0981 bit 0) is off:

- when it reaches OP, or
- when it refuses OP because it sees no SYNC0 (AL status code 0x002D).

With an ESI file (--esi) also the activation in OP: SYNC0, SYNC1 and a fixed cycle time must be those of an operation
mode of the device (AssignActivate, high byte). Without one the operation modes in the EEPROM (category 60) count, if
the capture shows the whole EEPROM: an info, because the slave accepts the activation.

If the slave controller has no distributed clocks (0x0008 bit 2 is 0), a refused write that activates SYNC0 (0x0981).

## Why it matters
The master meant to synchronise this drive, but without activation no pulse comes. The drive follows the arrival of the
frames, with all their jitter, or refuses to synchronise.

## How it is decided
- The master wrote the cycle to the address of this slave (not by a broadcast), and it is not 0.
- 0x0981 is known to be off when AL Status shows OP after a request. If 0x0981 is not in the capture, nothing is
  reported.
- Of AssignActivate the bits for cyclic operation, SYNC0 and SYNC1 count. The other bits are the choice of the master.
- An ESI file without operation modes is not compared.

## Example
tests/rules/sync-not-activated/violates.trace

## What to do
Write 0x0981 after start time and cycle: 3 for SYNC0, 7 for SYNC0 and SYNC1. With ESI or ENI this is the high byte of
AssignActivate. If you do not want distributed clocks, leave the cycle 0.
)"};

class SyncNotActivated final : public Rule {
 public:
  SyncNotActivated() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&SyncNotActivated::On);
    Subscribe<track::SlaveAccess>(&SyncNotActivated::On, MemoryRange::Of(esc::kDcActivation, 1));
  }

  /// Written to this slave, and refused.
  void On(const track::SlaveAccess& e) {
    const ByteSpan activation = e.Covered(e.written, esc::kDcActivation, 1);
    if (activation.empty() || e.broadcast || e.acceptance != track::Acceptance::kRefused) return;
    const esc::SyncActivation wanted{activation[0]};
    if (wanted.active() && wanted.sync0()) refused_writes_[e.slave] = {e.frame().number, wanted};
  }

  void On(const model::AlAnswered& e) {
    if (ReportNoClock(e)) return;
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused;
    if (refused && e.code.value_or(0) != esc::al_code::kNoSync) return;
    const sync::DcUnit& unit = context().sync().dc(e.slave);
    if (!unit.cycle_configured().seen()) return;
    if (!unit.activation()) return NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kActivation, e.frame.number);
    if (unit.activation()->active()) return refused ? void() : CompareWithModes(e, unit);
    const FrameNo cycle = unit.cycle_configured().number;
    const bool likely_missed = context().network().LikelyMissesBetween(cycle, e.request.frame.number);
    if (likely_missed && !refused) {
      return NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kActivation, e.frame.number);
    }
    FindingIndex index = Repeat(e.slave, refused ? 1 : 0, e.frame);
    const Severity severity = refused ? Severity::kError : kInfo.severity;
    if (index == kNoFinding) {
      Finding finding = Describe(e, unit, refused);
      if (likely_missed) finding.confidence = Confidence::kInferred;
      index = Report(refused ? 1 : 0, severity, std::move(finding));
    }
    if (refused) refusals_.push_back({e.slave, e.frame.number, index});
  }

  void Finish() override {
    for (const Refusal& refusal : refusals_) {
      NameCause(context(), "al-refused", refusal.slave, refusal.frame, refusal.cause);
    }
    (void)NotEvaluableWithoutReturns();
  }

 private:
  /// SAFEOP or OP without the clock that the master wants to use.
  bool ReportNoClock(const model::AlAnswered& e) {
    const auto wanted = refused_writes_.find(e.slave);
    if (wanted == refused_writes_.end()) return false;
    if (e.request.control.state() < static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return false;
    const esc::RegisterImage& registers = context().network().state(e.slave).registers;
    const auto features = registers.Value<std::uint8_t>(esc::kEscFeatures, Certainty::kObserved);
    if (!features || esc::HasClock(*features)) return false;
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused;
    if (refused && !esc::SpeaksOfSynchronisation(e.code.value_or(0))) return false;
    FindingIndex index = Repeat(e.slave, 2, e.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kNoClock, e.slave, e.frame);
      AddRelated(finding, wanted->second.frame);
      finding.Set("activation", arg::Hex(wanted->second.activation.raw, 2))
          .Set("write_frame", arg::Frame(wanted->second.frame))
          .Set("refused", arg::Flag(refused))
          .Set("requested", arg::State(e.request.control.state()));
      index = Report(2, std::move(finding));
    }
    if (refused) refusals_.push_back({e.slave, e.frame.number, index});
    return true;
  }

  struct RefusedWrite {
    FrameNo frame = 0;
    esc::SyncActivation activation;
  };
  struct Refusal {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  [[nodiscard]] static Finding Describe(const model::AlAnswered& e, const sync::DcUnit& unit, bool refused) {
    Finding finding = Found(refused ? kRefused : kReached, e.slave, e.frame);
    AddRelated(finding, unit.cycle_configured().number);
    AddRelated(finding, e.request.frame.number);
    finding.Set("activation", arg::Hex(unit.activation()->raw, 2))
        .Set("cycle_frame", arg::Frame(unit.cycle_configured().number));
    return finding;
  }

  /// Switched on: as one of the modes that the device offers? What the EEPROM lists may be less than the ESI.
  void CompareWithModes(const model::AlAnswered& e, const sync::DcUnit& unit) {
    if (!unit.active()) return;
    const OperationModes offered = OperationModesOf(context(), e.slave);
    if (offered.modes.empty()) return;
    const sync::SyncSettings& on = *unit.active();
    const ModeMatch match = Match(offered, on);
    if (match == ModeMatch::kFits || Repeat(e.slave, 1, e.frame) != kNoFinding) return;
    Finding finding = Found(match == ModeMatch::kOtherCycle ? kOtherCycle : kOtherActivation, e.slave, e.frame);
    AddRelated(finding, on.frame.number);
    finding.reference = ReferenceTo("ETG2000, Dc/OpMode");
    finding.Set("activation", arg::Hex(on.activation.raw, 2)).Set("activation_frame", arg::Frame(on.frame.number));
    if (on.sync0_cycle_ns) finding.Set("sync0_cycle_ns", arg::Ns(*on.sync0_cycle_ns));
    SetOffered(finding.arguments, offered);
    Report(1, offered.from_eeprom() ? Severity::kInfo : kInfo.severity, std::move(finding));
  }

  std::vector<Refusal> refusals_;
  std::map<SlaveId, RefusedWrite> refused_writes_;  ///< of 0x0981
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncNotActivated>};

}  // namespace
}  // namespace ecaudit::sync_not_activated
