#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
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
                         .source = "ESC-1, distributed clocks, SYNC signal generation",
                         .doc = R"(
## What it checks
A slave that reaches OP with a SYNC0 cycle (0x09A0) written for it, while cyclic operation (0x0981 bit 0) is off.

## Why it matters
The master meant to synchronise this drive; without activation no pulse comes. The drive runs by the arrival of the
frames, with all their jitter, or refuses to synchronise.

## How it is decided
The cycle was written by the slave's own address (not by a broadcast) and is not 0, and 0x0981 is known to be off
when AL Status shows OP after a request. Where 0x0981 was never seen nothing is said.

## Example
tests/rules/sync-not-activated/violates.trace

## What to do
Write 0x0981 after start time and cycle: 3 for SYNC0, 7 for SYNC0 and SYNC1. With ESI or ENI this is the high byte of
AssignActivate. If distributed clocks are not wanted, leave the cycle 0.
)"};

class SyncNotActivated final : public Rule {
 public:
  SyncNotActivated() : Rule(kInfo) { Hear<model::AlAnswered>(&SyncNotActivated::On); }

  void On(const model::AlAnswered& e) {
    if (e.outcome == model::AlAnswered::Outcome::kRefused ||
        e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
      return;
    }
    const sync::DcUnit& unit = context().sync().dc(e.slave);
    if (!unit.cycle_configured().seen()) return;
    if (!unit.activation()) {
      NotEvaluable(e.slave, "whether SYNC is switched on (0x0981) is not known", e.frame.number);
      return;
    }
    if (unit.activation()->active() || Repeat(e.slave, 0, e.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    AddRelated(finding, unit.cycle_configured().number);
    AddRelated(finding, e.request.frame.number);
    finding.title = "OP reached with a SYNC0 cycle but SYNC0 off";
    finding.message =
        "Frame " + std::to_string(unit.cycle_configured().number) +
        " writes a SYNC0 cycle (0x09A0) for this slave, but 0x0981 is " + Hex(unit.activation()->raw, 2) +
        " when frame " + std::to_string(e.frame.number) +
        " shows OP: no SYNC0 is generated, and the drive is not synchronised to the other axes. Switch it "
        "on after start time and cycle (0x0981 = 3), or leave the cycle 0.";
    finding.evidence = {HexNumber("activation", unit.activation()->raw)};
    Report(0, std::move(finding));
  }

  void Finish() override { (void)SaidNothingReturned(); }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncNotActivated>};

}  // namespace
}  // namespace ecaudit::sync_not_activated
