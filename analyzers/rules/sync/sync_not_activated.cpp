#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"

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
    .title = "SYNC0 cycle of {sync0_cycle_ns} is in no operation mode of the ESI",
    .message = R"(When {frame} shows OP, 0x0981 is {activation} with a SYNC0 cycle of {sync0_cycle_ns}
({activation_frame}). The ESI of the device offers these values of 0x0981: {offered}[ and {more}].)",
    .next = "Choose one of these operation modes in the configuration of the master."};

constexpr FindingKind kOtherActivation{
    .name = "activation-not-offered",
    .title = "Activation 0x0981 = {activation} is in no operation mode of the ESI",
    .message = R"(When {frame} shows OP, 0x0981 is {activation}[ with a SYNC0 cycle of {sync0_cycle_ns}]
({activation_frame}). The ESI of the device offers these values of 0x0981: {offered}[ and {more}].)",
    .next = "Choose one of these operation modes in the configuration of the master."};

constexpr const FindingKind* kKinds[] = {&kReached, &kRefused, &kOtherCycle, &kOtherActivation};

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
mode of the device (AssignActivate, high byte).

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
  SyncNotActivated() : Rule(kInfo) { Subscribe<model::AlAnswered>(&SyncNotActivated::On); }

  void On(const model::AlAnswered& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused;
    if (refused && e.code.value_or(0) != esc::al_code::kNoSync) return;
    const sync::DcUnit& unit = context().sync().dc(e.slave);
    if (!unit.cycle_configured().seen()) return;
    if (!unit.activation()) return NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kActivation, e.frame.number);
    if (unit.activation()->active()) return refused ? void() : CompareWithEsi(e, unit);
    FindingIndex index = Repeat(e.slave, refused ? 1 : 0, e.frame);
    const Severity severity = refused ? Severity::kError : kInfo.severity;
    if (index == kNoFinding) index = Report(refused ? 1 : 0, severity, Describe(e, unit, refused));
    if (refused) refusals_.push_back({e.slave, e.frame.number, index});
  }

  void Finish() override {
    for (const Refusal& refusal : refusals_) {
      NameCause(context(), "al-refused", refusal.slave, refusal.frame, refusal.cause);
    }
    (void)NotEvaluableWithoutReturns();
  }

 private:
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

  static constexpr unsigned kCompared = 0x07;  ///< cyclic operation, SYNC0, SYNC1
  static constexpr std::size_t kMostNamed = 6;

  [[nodiscard]] static esc::SyncActivation WantedBy(const device::DcMode& mode) {
    return esc::AssignActivate{static_cast<std::uint16_t>(mode.assign_activate & 0xFFFFU)}.activation();
  }
  /// A fixed cycle is given without a factor.
  [[nodiscard]] static bool HasFixedCycle(const device::DcMode& mode) {
    return mode.cycle_sync0.value_or(0) > 0 && mode.factor_sync0 == 0;
  }
  /// {offered}: "0x07 (DC8, 125.00 us)" of each, and {more}: how many are not named.
  static void SetOffered(Finding& finding, const std::vector<device::DcMode>& modes) {
    std::vector<Value> offered;
    for (std::size_t i = 0; i < std::min(modes.size(), kMostNamed); ++i) {
      const device::DcMode& mode = modes[i];
      std::string name = mode.name;
      if (HasFixedCycle(mode)) name += (name.empty() ? "" : ", ") + Duration(*mode.cycle_sync0);
      offered.push_back(arg::Code(WantedBy(mode).raw, name, 2));
    }
    finding.Set("offered", arg::List(std::move(offered)));
    if (modes.size() > kMostNamed) finding.Set("more", arg::Count(modes.size() - kMostNamed, "other"));
  }

  /// Switched on: as one of the modes that the ESI offers?
  void CompareWithEsi(const model::AlAnswered& e, const sync::DcUnit& unit) {
    const device::DeviceDescription& device = *context().slave(e.slave).profile;
    if (!device.esi || device.esi->dc_modes.empty() || !unit.active()) return;
    const sync::SyncSettings& on = *unit.active();
    const std::optional<std::uint32_t> cycle = on.sync0_cycle_ns;
    bool same_units = false;
    for (const device::DcMode& mode : device.esi->dc_modes) {
      const bool units = (WantedBy(mode).raw & kCompared) == (on.activation.raw & kCompared);
      if (units && (!HasFixedCycle(mode) || !cycle || *cycle == *mode.cycle_sync0)) return;
      same_units = same_units || units;
    }
    if (Repeat(e.slave, 1, e.frame) != kNoFinding) return;
    Finding finding = Found(same_units ? kOtherCycle : kOtherActivation, e.slave, e.frame);
    AddRelated(finding, on.frame.number);
    finding.reference = ReferenceTo("ETG2000, Dc/OpMode");
    finding.Set("activation", arg::Hex(on.activation.raw, 2)).Set("activation_frame", arg::Frame(on.frame.number));
    if (cycle) finding.Set("sync0_cycle_ns", arg::Ns(*cycle));
    SetOffered(finding, device.esi->dc_modes);
    Report(1, std::move(finding));
  }

  std::vector<Refusal> refusals_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncNotActivated>};

}  // namespace
}  // namespace ecaudit::sync_not_activated
