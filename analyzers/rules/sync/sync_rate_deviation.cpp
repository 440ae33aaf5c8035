#include <cmath>
#include <set>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"

namespace ecaudit::sync_rate_deviation {
namespace {

constexpr std::uint64_t kEnoughCycles = 200;
/// Further off than this it is another cycle: sync-cycle-mismatch.
constexpr double kAnotherCycle = 100'000;
/// Frames that move by this part of a cycle against SYNC0 are not locked to it.
constexpr double kMovedCycles = 0.5;
/// Only if it is so much larger than its uncertainty.
constexpr double kSure = 4;
constexpr std::uint64_t kNotLockedKey = 1;
/// How far the clock of a host may be off, ppm.
constexpr double kHostClock = 100;

constexpr Word kPllRange{"pll-range", "the range of the PLL"};
constexpr Word kCyclesInOp{"cycles-in-op", "cycles with process data in OP (200 needed)", true};
constexpr Word kMeanCycle{"mean-cycle", "the deviation of the mean cycle"};

constexpr FindingKind kOff{
    .name = "mean-cycle-off",
    .title = "Mean cycle deviates by {deviation_ppm}, the PLL follows {pll_range_ppm}",
    .message = R"(In OP the mean of {cycles} from {frame} to {end_frame} is {mean_us}, by {time_base}. The configured
cycle is {configured_us}, so the deviation is {deviation_ppm} (+-{uncertainty_ppm}). [The manual
({manual})][{!manual}The EtherCAT standard] gives {pll_range_ppm} as the range of the PLL.)",
    .next =
        R"([{?by_sync0}Let the cycle of the master follow the DC time.][{!by_sync0}Let the master send by a timer that
keeps the configured cycle in the mean.])"};

constexpr FindingKind kNotLocked{
    .name = "not-locked",
    .title = "Frames are not locked to SYNC0: cycle {mean_us}, SYNC0 {configured_us}",
    .message = R"(In OP the mean of {cycles} from {frame} to {end_frame} is {mean_us}, by {time_base}. SYNC0 comes every
{configured_us}. So the frames have moved by {drift_us} against SYNC0. A slave that takes its outputs at SYNC0
[{?slower}repeats][{!slower}misses] a set point once in {slip_cycles}.)",
    .next = R"(Let the cycle of the master follow the DC time: shift its timer by the phase of 0x0910. If the slave does
not take its outputs at SYNC0, it misses no set point.)"};

constexpr const FindingKind* kKinds[] = {&kOff, &kNotLocked};

constexpr RuleInfo kInfo{
    .id = "sync-rate-deviation",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .subject = Subject::kCycle,
    .title = "The mean cycle deviates by more than the drive can follow",
    .needs = "SYNC0 cycle or 60C2h, at least 200 cycles in OP, a clock; for the limit the PLL range of the family",
    .source = "AKD-2011, 4.10; AKD-2010, 4.10; MKD, 4.11; PILZ, 4.8",
    .kinds = kKinds,
    .doc = R"(
## What it checks
The mean distance of the process data in OP against the configured cycle. The limit is the range of the PLL: 4800 ppm
for AKD and MKD (300 ns in each 62.5 us), 1000 ppm for Pilz.

## Why it matters
The PLL of the drive stretches and shrinks its own clock to follow the master. Beyond its range the drive cannot stay
synchronised, even without jitter.

## How it is decided
- The configured cycle is that of SYNC0, else that of 60C2h as the master wrote it.
- The mean is taken over the cycles in OP. It ends when the slave leaves OP, SYNC0 is switched off, or the frames come
  in another rhythm.
- An interval of n cycles counts as n. If jitter leaves n open, it counts together with the following intervals. Pauses
  of more than 16 cycles are left out.
- The DC time counts as exact. With stamps, 100 ppm of the clock of the host are added to their uncertainty.
- The jitter of the frames makes the mean uncertain, too. If the limit lies within that uncertainty, the mean is not
  evaluated.
- If the intervals differ from whole cycles by more than an eighth in the mean, pauses make it uncertain as well.
- The mean is not evaluated either if most cycles are as long as configured, and pauses of no whole number of cycles
  move it.
- A deviation of more than a tenth is another cycle, which sync-cycle-mismatch reports.
- If no PLL range is known and SYNC0 is on, the frames may move by half a cycle against it in the capture. More is an
  inferred warning: the master is not locked. The rule assumes that the slave takes its outputs at SYNC0.

## Example
tests/rules/sync-rate-deviation/violates.trace

## What to do
With distributed clocks, let the cycle of the master follow the DC time: shift its timer by the phase that it reads with
FRMW of 0x0910. Without, use a timer that keeps the configured period in the mean.
)"};

class SyncRateDeviation final : public Rule {
 public:
  SyncRateDeviation() : Rule(kInfo) { Subscribe<sync::RateEnded>(&SyncRateDeviation::On); }

  void On(const sync::RateEnded& e) {
    if (context().sync().outputs(e.slave).rate.cycles() < kEnoughCycles) return;
    evaluated_.insert(e.slave);
    Evaluate(e.slave);
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (context().sync().outputs(id).rate.cycles() >= kEnoughCycles || !evaluated_.contains(id)) Evaluate(id);
    }
  }

 private:
  void Evaluate(SlaveId id) {
    const model::SlaveModel& slave = context().slave(id);
    // Of a run that ended unevaluated the settings still show that there was something to evaluate.
    const sync::DcUnit& unit = context().sync().dc(id);
    const bool ended = context().sync().outputs(id).rate.cycles() == 0;
    const auto& settings = ended ? unit.activated() : unit.last_active();
    TimeNs configured = 0;
    if (settings && settings->activation.sync0()) configured = settings->sync0_cycle_ns.value_or(0);
    if (configured == 0) configured = model::InterpolationTime(slave).value_or(0);
    if (configured == 0) return;
    const auto& range = slave.profile->sync.pll_range_ppm;
    const bool by_sync0 = settings && settings->activation.sync0();
    if (!range.value && !by_sync0) return NotEvaluable(id, ReasonCode::kNotInProfile, kPllRange);
    const sync::OutputWatch& outputs = context().sync().outputs(id);
    if (outputs.rate.cycles() < kEnoughCycles) return NotEvaluable(id, ReasonCode::kTooFew, kCyclesInOp);
    const auto uncertainty = context().sync().Uncertainty(outputs.rate.base());
    if (!uncertainty) return NotEvaluable(id, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming);
    const sync::OutputRate& rate = outputs.rate;
    const double ppm = (rate.mean_ns() / static_cast<double>(configured) - 1) * 1e6;
    const double unsure = 2e6 * static_cast<double>(*uncertainty) / static_cast<double>(rate.ns()) +
                          1e6 * rate.JitterShare() + (rate.base() == sync::TimeBase::kDc ? 0 : kHostClock);
    if (!range.value) {
      EvaluateAnySlave(id, configured, ppm, unsure);
      return;
    }
    const auto limit = static_cast<double>(*range);
    if (std::abs(ppm) > kAnotherCycle || std::abs(ppm) + unsure <= limit) return;
    if (std::abs(ppm) - unsure <= limit) {
      // By the DC time nothing but jitter is uncertain.
      if (rate.base() == sync::TimeBase::kDc) {
        NotEvaluable(id, ReasonCode::kTooIrregular, what::kProcessDataTiming);
      } else {
        NotEvaluable(id, ReasonCode::kWithinUncertainty, kMeanCycle);
      }
      return;
    }
    const double usual_ppm = (static_cast<double>(rate.usual()) / static_cast<double>(configured) - 1) * 1e6;
    if (std::abs(usual_ppm) <= limit) return NotEvaluable(id, ReasonCode::kTooIrregular, what::kProcessDataTiming);
    ReportOff(id, configured, ppm, unsure);
  }

  /// Frames that have moved by half a cycle have left their place between two pulses.
  void EvaluateAnySlave(SlaveId id, TimeNs configured, double ppm, double unsure) {
    const sync::OutputRate& rate = context().sync().outputs(id).rate;
    const double usual_ppm = (static_cast<double>(rate.usual()) / static_cast<double>(configured) - 1) * 1e6;
    const double moved_cycles = (std::abs(ppm) - unsure) * 1e-6 * static_cast<double>(rate.cycles());
    if (std::abs(ppm) > kAnotherCycle || moved_cycles < kMovedCycles || std::abs(usual_ppm) < std::abs(ppm) / 2) {
      NotEvaluable(id, ReasonCode::kNotInProfile, kPllRange);
      return;
    }
    if (unsure * kSure > std::abs(ppm)) return NotEvaluable(id, ReasonCode::kTooIrregular, what::kProcessDataTiming);
    if (Repeat(id, kNotLockedKey, rate.first()) != kNoFinding) return;
    Finding finding = Found(kNotLocked, id, rate.first());
    finding.confidence = Confidence::kInferred;
    finding.last = rate.last();
    if (const auto& settings = context().sync().dc(id).last_active()) AddRelated(finding, settings->frame.number);
    finding.reference = ReferenceTo("ESC-1, distributed clocks, SYNC signal generation");
    const double drift_ns = std::abs(ppm) * 1e-6 * static_cast<double>(configured) * static_cast<double>(rate.cycles());
    finding.Set("mean_us", arg::Real(rate.mean_ns() / 1e3, "us", 3))
        .Set("configured_us", arg::Real(static_cast<double>(configured) / 1e3, "us", 3))
        .Set("drift_us", arg::Us(static_cast<TimeNs>(drift_ns)))
        .Set("slip_cycles", arg::Count(static_cast<std::uint64_t>(1e6 / std::abs(ppm)), "cycle"))
        .Set("slower", arg::Flag(ppm > 0))
        .Set("cycles", arg::Count(rate.cycles(), "cycle"))
        .Set("deviation_ppm", arg::Real(ppm, "ppm", 0))
        .Set("uncertainty_ppm", arg::Real(unsure, "ppm"))
        .Set("end_frame", arg::Frame(rate.last().number))
        .Set("time_base", arg::Of(WordOf(rate.base())));
    Report(kNotLockedKey, Severity::kWarning, std::move(finding));
  }

  void ReportOff(SlaveId id, TimeNs configured, double ppm, double unsure) {
    const sync::OutputRate& rate = context().sync().outputs(id).rate;
    if (Repeat(id, 0, rate.first()) != kNoFinding) return;
    const device::DeviceDescription& profile = *context().slave(id).profile;
    const auto& settings = context().sync().dc(id).last_active();
    const bool by_sync0 = settings && settings->activation.sync0();
    const auto& range = profile.sync.pll_range_ppm;
    Finding finding = Found(kOff, id, rate.first());
    finding.last = rate.last();
    if (settings) AddRelated(finding, settings->frame.number);
    finding.reference = ReferenceTo(range.source);
    finding.Set("deviation_ppm", arg::Real(ppm, "ppm", 0))
        .Set("uncertainty_ppm", arg::Real(unsure, "ppm"))
        .Set("pll_range_ppm", arg::Real(*range, "ppm", 0))
        .Set("mean_us", arg::Real(rate.mean_ns() / 1e3, "us", 3))
        .Set("configured_us", arg::Real(static_cast<double>(configured) / 1e3, "us", 3))
        .Set("cycles", arg::Count(rate.cycles(), "cycle"))
        .Set("end_frame", arg::Frame(rate.last().number))
        .Set("time_base", arg::Of(WordOf(rate.base())))
        .Set("by_sync0", arg::Flag(by_sync0));
    SetManual(finding, profile);
    Report(0, std::move(finding));
  }

  std::set<SlaveId> evaluated_;  // in a run that has ended
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncRateDeviation>};

}  // namespace
}  // namespace ecaudit::sync_rate_deviation
