#include <bit>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"

namespace ecaudit::sync_pll_off {
namespace {

constexpr FindingKind kOff{
    .name = "pll-off",
    .title = "{parameter} = {value} switches the PLL off, but SYNC0 is on",
    .message =
        R"(When {frame} shows OP, SYNC0 is on (0x0981 = {activation}), but {parameter} is {value}[ ({value_frame})].
By {parameter_source} the drive is synchronised only while [{bit_count?bit|bits} {on_bits} of {parameter}
{bit_count?is|are} 1][{bit_count?bit|bits} {off_bits} of {parameter} {bit_count?is|are} 0][{!bit_count}{parameter} is
not 0]. So the drive follows its own clock, and its set points may come early or late.)",
    .next = "Set {parameter} to {on_value} and store it, or switch distributed clocks off.",
    .identity = "parameter"};

constexpr const FindingKind* kKinds[] = {&kOff};

constexpr Word kSwitch{"pll-switch", "the parameter that switches the PLL of the drive (--parameter)"};

constexpr RuleInfo kInfo{.id = "sync-pll-off",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .of_family = true,
                         .subject = Subject::kClock,
                         .title = "SYNC0 is on, but a parameter switches the PLL of the drive off",
                         .needs = "the parameter that switches the PLL, by SDO or --parameter; 0x0981; AL Status OP",
                         .source = "AKD-2010, 4.10 and 4.13; AKD-2011, 4.10 and 4.13; MKD, 4.11",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether the PLL of the drive is on when the slave reaches OP with SYNC0. The manuals of AKD and MKD have a parameter for
it: bit 0 of FBUS.PARAM02 (36E6h).

## Why it matters
The pulses come, and the drive ignores them. Its interpolation drifts against the master: the axis hums or jerks every
few seconds.

## How it is decided
- The value was written or read by SDO, or given with --parameter.
- Of a family whose manual prints no dictionary, the object is that of a sister family: the finding is inferred.
- Without SYNC0 the drive follows the output sync manager, and nothing is evaluated.

## Example
tests/rules/sync-pll-off/violates.trace

## What to do
Set FBUS.PARAM02 to 1 and store the parameters of the drive.
)"};

class SyncPllOff final : public Rule {
 public:
  SyncPllOff() : Rule(kInfo) { Subscribe<model::AlAnswered>(&SyncPllOff::On); }

  void On(const model::AlAnswered& e) {
    const bool reached = e.outcome != model::AlAnswered::Outcome::kRefused;
    if (!reached || e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const auto& activation = context().sync().dc(e.slave).activation();
    if (!activation || !activation->sync0()) return;
    const model::SlaveModel& slave = context().slave(e.slave);
    const std::optional<device::DriveParameter>& parameter = slave.profile->sync.pll_switch;
    if (!parameter) return;
    const auto value = model::ValueOf(slave, parameter);
    if (!value) return NotEvaluable(e.slave, ReasonCode::kNotRead, kSwitch, e.frame.number);
    if (parameter->IsOn(value->value)) return;
    constexpr std::uint64_t kKey = 0;
    if (Repeat(e.slave, kKey, e.frame) != kNoFinding) return;
    Finding finding = Found(kOff, e.slave, e.frame);
    if (value->certainty != Certainty::kObserved) finding.confidence = Confidence::kInferred;
    finding.Set("parameter", arg::Text(parameter->keyword))
        .Set("value", arg::Number(value->value))
        .Set("activation", arg::Hex(activation->raw, 2))
        .Set("parameter_source", arg::Text(parameter->source))
        .Set("on_value", arg::Number(parameter->OnValue(value->value)));
    // Without bits, any value but 0 switches it on.
    if (const std::uint32_t bits = parameter->on_bits != 0 ? parameter->on_bits : parameter->off_bits; bits != 0) {
      finding.Set(parameter->on_bits != 0 ? "on_bits" : "off_bits", arg::Bits(bits))
          .Set("bit_count", arg::Number(std::popcount(bits)));
    }
    if (value->since != 0) {
      finding.Set("value_frame", arg::Frame(value->since));
      AddRelated(finding, value->since);
    }
    finding.reference = ReferenceTo(parameter->source);
    Report(kKey, std::move(finding));
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncPllOff>};

}  // namespace
}  // namespace ecaudit::sync_pll_off
