#include <cmath>

#include "analyzers/core/al_text.h"
#include "analyzers/core/rule.h"
#include "analyzers/core/sync_text.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr std::uint64_t kEnoughCycles = 50;
/// Deviations up to this are a matter of sync-rate-deviation and of the master's jitter.
constexpr double kTolerance = 0.1;

constexpr RuleInfo kInfo{
    .id = "sync-cycle-mismatch",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .title = "SYNC0 cycle, interpolation time and the rhythm of the process data disagree",
    .needs = "two of: SYNC0 cycle (0x09A0), object 60C2h, at least 50 cycles of process data in OP",
    .source = "ESC-1, distributed clocks; AKD-2011, 4.8; MKD, 4.9; PILZ, 4.6",
    .doc = R"(
## What it checks
That the SYNC0 cycle (0x09A0), the interpolation time that the master wrote (60C2h) and the distance of the process
data in OP are the same time.

## Why it matters
The drive interpolates its setpoints over 60C2h and executes them with SYNC0. If frames come in another rhythm it
repeats setpoints or skips them: the axis is jerky, follows with a wrong velocity or loses synchronisation.

## How it is decided
SYNC0 cycle and 60C2h are compared exactly when OP is requested, for families that take the cycle from 60C2h. The
process data are the mean over the cycles in OP, by the DC time in the frames or by good stamps; it disagrees when it
is more than a tenth off. For devices whose family is not known to need one frame a cycle, SYNC0 may be a multiple of
the frame cycle or a part of it.

## Example
tests/rules/sync-cycle-mismatch/violates.trace

## What to do
Set one cycle time in the master's configuration, and let it write 0x09A0 and 60C2h from it.
)"};

class SyncCycleMismatch final : public Rule {
 public:
  using Rule::On;
  SyncCycleMismatch() : Rule(kInfo) { Subscribe({Topic::kAlRequestJudged}); }

  void On(const model::AlRequestJudged& e) override {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const model::SlaveModel& slave = context().bus.slave(e.slave);
    const auto& active = context().sync->dc(e.slave).active();
    const auto interpolation = InterpolationTime(slave);
    if (!slave.profile->sync.cycle_by_60c2.value.value_or(false) || !interpolation || !active ||
        !active->activation.sync0() || active->sync0_cycle_ns.value_or(0) == 0 ||
        *interpolation == TimeNs{*active->sync0_cycle_ns}) {
      return;
    }
    if (Repeat(e.slave, 0, e.request.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.request.frame;
    AddRelated(finding, active->frame.number);
    AddRelated(finding, slave.objects.Find(0x60C2, 1)->since);
    finding.reference = ReferenceTo(slave.profile->sync.cycle_by_60c2.source);
    finding.title =
        "SYNC0 cycle is " + Duration(*active->sync0_cycle_ns) + ", but 60C2h says " + Duration(*interpolation);
    finding.message = "When OP is requested in frame " + std::to_string(e.request.frame.number) +
                      " the SYNC0 cycle is " + std::to_string(*active->sync0_cycle_ns) +
                      " ns (0x09A0), while the interpolation time that the master "
                      "wrote to 60C2h is " +
                      std::to_string(*interpolation) + " ns. Write the same time to both.";
    finding.evidence = {Number("sync0_cycle_ns", *active->sync0_cycle_ns), Number("interpolation_ns", *interpolation)};
    Report(0, std::move(finding));
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().bus.size(); ++s) Observed(static_cast<SlaveId>(s));
  }

 private:
  void Observed(SlaveId id) {
    const model::SlaveModel& slave = context().bus.slave(id);
    const auto& settings = context().sync->dc(id).last_active();
    const auto interpolation = InterpolationTime(slave);
    TimeNs configured = 0;
    const char* what = "SYNC0 cycle (0x09A0)";
    if (settings && settings->activation.sync0() && settings->sync0_cycle_ns.value_or(0) > 0) {
      configured = *settings->sync0_cycle_ns;
    } else if (interpolation && slave.profile->sync.cycle_by_60c2.value.value_or(false)) {
      configured = *interpolation;
      what = "interpolation time (60C2h)";
    }
    if (configured == 0) return;
    const sync::OutputWatch& outputs = context().sync->outputs(id);
    if (outputs.rate_cycles < kEnoughCycles) {
      NotEvaluable(id, "fewer than 50 cycles of process data in OP to compare the configured cycle with");
      return;
    }
    if (!context().sync->Uncertainty(outputs.rate_base)) {
      NotEvaluable(id, std::string(kPoorStamps));
      return;
    }
    const auto mean = static_cast<double>(outputs.rate_ns) / static_cast<double>(outputs.rate_cycles);
    const double ratio = mean / static_cast<double>(configured);
    const bool one_each = !slave.profile->sync.source_with_dc.empty();
    const double nearest = one_each ? 1.0 : ratio >= 1 ? std::round(ratio) : 1.0 / std::round(1.0 / ratio);
    if (std::abs(ratio / nearest - 1) <= kTolerance) return;
    Finding finding;
    finding.slave = id;
    finding.first = outputs.rate_first;
    finding.last = outputs.rate_last;
    if (settings) AddRelated(finding, settings->frame.number);
    const std::string cycle = Duration(static_cast<std::int64_t>(mean));
    finding.title = "Process data come every " + cycle + ", but the cycle is configured as " + Duration(configured);
    finding.message =
        "In OP the outputs of this slave come every " + cycle + " in the mean of " + Grouped(outputs.rate_cycles) +
        " cycles, " + std::string(BaseText(outputs.rate_base)) + "; the " + what + " is " + std::to_string(configured) +
        " ns" + (one_each ? ", and the drive expects one frame in each cycle." : ", neither a multiple nor a part.") +
        " Let the master run with the configured cycle, or configure the one it runs with.";
    finding.evidence = {Real("observed_us", mean / 1e3), Real("configured_us", static_cast<double>(configured) / 1e3),
                        Text("time_base", std::string(sync::Name(outputs.rate_base)))};
    Report(1, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncCycleMismatch>};

}  // namespace
}  // namespace ecaudit
