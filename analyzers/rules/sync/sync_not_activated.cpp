#include <algorithm>
#include <string>
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

constexpr RuleInfo kInfo{.id = "sync-not-activated",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .subject = Subject::kClock,
                         .title = "A SYNC0 cycle is configured, but SYNC0 never switched on before OP",
                         .needs = "writes of 0x09A0 and 0x0981 of the slave, AL Status OP",
                         .source = "ESC-1, distributed clocks, SYNC signal generation; ETG2000, Dc/OpMode",
                         .doc = R"(
## What it checks
A slave that reaches OP, or refuses it because it sees no SYNC0 (AL status code 0x002D), with a SYNC0 cycle (0x09A0)
written for it, while cyclic operation (0x0981 bit 0) is off. With
an ESI file (--esi): also SYNC0 and SYNC1 that are switched on in OP as none of its operation modes has it
(AssignActivate, high byte; a cycle time that a mode fixes).

## Why it matters
The master meant to synchronise this drive; without activation no pulse comes. The drive runs by the arrival of the
frames, with all their jitter, or refuses to synchronise.

## How it is decided
The cycle was written by the slave's own address (not by a broadcast) and is not 0, and 0x0981 is known to be off
when AL Status shows OP after a request. Where 0x0981 was never seen nothing is said. Of AssignActivate the bits for
cyclic operation, SYNC0 and SYNC1 count; the others are the master's own. A file without modes says nothing.

## Example
tests/rules/sync-not-activated/violates.trace

## What to do
Write 0x0981 after start time and cycle: 3 for SYNC0, 7 for SYNC0 and SYNC1. With ESI or ENI this is the high byte of
AssignActivate. If distributed clocks are not wanted, leave the cycle 0.
)"};

class SyncNotActivated final : public Rule {
 public:
  SyncNotActivated() : Rule(kInfo) { Subscribe<model::AlAnswered>(&SyncNotActivated::On); }

  void On(const model::AlAnswered& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused;
    if (refused && e.code.value_or(0) != kNoSync) return;
    const sync::DcUnit& unit = context().sync().dc(e.slave);
    if (!unit.cycle_configured().seen()) return;
    if (!unit.activation()) {
      NotEvaluable(e.slave, "whether SYNC is switched on (0x0981) is not known", e.frame.number);
      return;
    }
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
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    AddRelated(finding, unit.cycle_configured().number);
    AddRelated(finding, e.request.frame.number);
    finding.title = std::string(refused ? "OP refused" : "OP reached") + " with a SYNC0 cycle but SYNC0 off";
    finding.message =
        "Frame " + std::to_string(unit.cycle_configured().number) +
        " writes a SYNC0 cycle (0x09A0) for this slave, but 0x0981 is " + Hex(unit.activation()->raw, 2) +
        " when frame " + std::to_string(e.frame.number) +
        (refused
             ? " shows that OP is refused: no SYNC0 is generated, and the drive says that it sees none. Switch it "
             : " shows OP: no SYNC0 is generated, and the drive is not synchronised to the other axes. Switch it ") +
        "on after start time and cycle (0x0981 = 3), or leave the cycle 0.";
    finding.evidence = {HexNumber("activation", unit.activation()->raw)};
    return finding;
  }

  static constexpr std::uint16_t kNoSync = 0x002D;  ///< "no sync error": SYNC0 was never seen
  static constexpr unsigned kCompared = 0x07;       ///< cyclic operation, SYNC0, SYNC1
  static constexpr std::size_t kMostNamed = 6;

  [[nodiscard]] static esc::SyncActivation WantedBy(const device::DcMode& mode) {
    return esc::AssignActivate{static_cast<std::uint16_t>(mode.assign_activate & 0xFFFFU)}.activation();
  }
  /// A cycle that is fixed stands there without a factor.
  [[nodiscard]] static bool HasFixedCycle(const device::DcMode& mode) {
    return mode.cycle_sync0.value_or(0) > 0 && mode.factor_sync0 == 0;
  }
  [[nodiscard]] static std::string OfferedText(const std::vector<device::DcMode>& modes) {
    std::string text;
    for (std::size_t i = 0; i < std::min(modes.size(), kMostNamed); ++i) {
      const device::DcMode& mode = modes[i];
      text += (i == 0 ? "" : ", ") + (mode.name.empty() ? std::string("a mode") : mode.name) +
              " (0x0981 = " + Hex(WantedBy(mode).raw, 2) +
              (HasFixedCycle(mode) ? ", SYNC0 every " + Duration(*mode.cycle_sync0) : "") + ")";
    }
    if (modes.size() > kMostNamed) text += " and " + std::to_string(modes.size() - kMostNamed) + " more";
    return text;
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
    const std::string offered = OfferedText(device.esi->dc_modes);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    AddRelated(finding, on.frame.number);
    finding.title = same_units ? "SYNC0 runs with a cycle that the ESI does not offer"
                               : "SYNC0 and SYNC1 are switched on as the ESI does not offer it";
    finding.message = "When frame " + std::to_string(e.frame.number) + " shows OP, 0x0981 is " +
                      Hex(on.activation.raw, 2) + (cycle ? " with a SYNC0 cycle of " + Duration(*cycle) : "") +
                      " (frame " + std::to_string(on.frame.number) + "). The ESI of the device offers: " + offered +
                      ". Choose one of these operation modes in the master's configuration.";
    finding.reference = ReferenceTo("ETG2000, Dc/OpMode");
    finding.evidence = {HexNumber("activation", on.activation.raw)};
    if (cycle) finding.evidence.push_back(Number("sync0_cycle_ns", *cycle));
    finding.evidence.push_back(Text("offered", offered));
    Report(1, std::move(finding));
  }

  std::vector<Refusal> refusals_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncNotActivated>};

}  // namespace
}  // namespace ecaudit::sync_not_activated
