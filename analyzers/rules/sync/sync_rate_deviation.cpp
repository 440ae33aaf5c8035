#include <cmath>
#include <set>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::sync_rate_deviation {
namespace {

constexpr std::uint64_t kEnoughCycles = 200;
/// Further off than this it is another cycle: sync-cycle-mismatch.
constexpr double kAnotherCycle = 100'000;
/// How far the clock of a host may be off, ppm.
constexpr double kHostClock = 100;

constexpr RuleInfo kInfo{
    .id = "sync-rate-deviation",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .subject = Subject::kCycle,
    .title = "The mean cycle deviates from the configured one by more than the drive's PLL can follow",
    .needs = "SYNC0 cycle or 60C2h, the family's PLL range, at least 200 cycles in OP, a clock",
    .source = "AKD-2011, 4.10; AKD-2010, 4.10; MKD, 4.11; PILZ, 4.8",
    .doc = R"(
## What it checks
The mean distance of the process data in OP against the configured cycle: 4800 ppm for AKD and MKD (300 ns in each
62.5 us), 1000 ppm for Pilz.

## Why it matters
The drive's PLL stretches and shrinks its own clock to follow the master. Beyond its range the drive cannot stay
synchronised, however small the jitter is.

## How it is decided
The mean is taken over the cycles in OP, until the slave leaves it, SYNC0 is switched off or the frames come to another
rhythm. An interval of n cycles counts as n, and where jitter leaves open how many it is, together with those behind it;
pauses of more than 16 are left out. By DC time the clock is exact; by stamps 100 ppm of the host's clock are added to
their uncertainty. The jitter of the frames makes the mean uncertain, too: a limit inside all that is not judged; nor is
a mean that pauses of no whole number of cycles have moved, while most cycles are as long as configured. The configured
cycle is that of SYNC0, else the 60C2h the master wrote. More than a tenth off is another cycle and told by
sync-cycle-mismatch.

## Example
tests/rules/sync-rate-deviation/violates.trace

## What to do
With distributed clocks, let the master's cycle follow the DC time (shift its timer by the phase it reads with FRMW
0x0910); without, use a timer that keeps the configured period in the mean.
)"};

class SyncRateDeviation final : public Rule {
 public:
  SyncRateDeviation() : Rule(kInfo) { Subscribe<sync::RateEnded>(&SyncRateDeviation::On); }

  void On(const sync::RateEnded& e) {
    if (context().sync().outputs(e.slave).rate.cycles() < kEnoughCycles) return;
    judged_.insert(e.slave);
    Judge(e.slave);
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (context().sync().outputs(id).rate.cycles() >= kEnoughCycles || !judged_.contains(id)) Judge(id);
    }
  }

 private:
  void Judge(SlaveId id) {
    const model::SlaveModel& slave = context().slave(id);
    // Of a run that ended without a judgement the settings still say that there was something to judge.
    const sync::DcUnit& unit = context().sync().dc(id);
    const bool ended = context().sync().outputs(id).rate.cycles() == 0;
    const auto& settings = ended ? unit.told() : unit.last_active();
    TimeNs configured = 0;
    if (settings && settings->activation.sync0()) configured = settings->sync0_cycle_ns.value_or(0);
    if (configured == 0) configured = model::InterpolationTime(slave).value_or(0);
    if (configured == 0) return;
    const auto& range = slave.profile->sync.pll_range_ppm;
    if (!range.value) {
      NotEvaluable(id, "the profile states no range of the PLL");
      return;
    }
    const sync::OutputWatch& outputs = context().sync().outputs(id);
    if (outputs.rate.cycles() < kEnoughCycles) {
      NotEvaluable(id, "fewer than 200 cycles of process data in OP to take a mean of");
      return;
    }
    const auto uncertainty = context().sync().Uncertainty(outputs.rate.base());
    if (!uncertainty) {
      NotEvaluable(id, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming);
      return;
    }
    const sync::OutputRate& rate = outputs.rate;
    const double ppm = (rate.mean_ns() / static_cast<double>(configured) - 1) * 1e6;
    const double unsure = 2e6 * static_cast<double>(*uncertainty) / static_cast<double>(rate.ns()) +
                          1e6 * rate.JitterShare() + (rate.base() == sync::TimeBase::kDc ? 0 : kHostClock);
    const auto limit = static_cast<double>(*range);
    if (std::abs(ppm) > kAnotherCycle || std::abs(ppm) + unsure <= limit) return;
    if (std::abs(ppm) - unsure <= limit) {
      NotEvaluable(id, "the mean deviation of the cycle equals the limit within the uncertainty of clock and jitter");
      return;
    }
    const double usual_ppm = (static_cast<double>(rate.usual()) / static_cast<double>(configured) - 1) * 1e6;
    if (std::abs(usual_ppm) <= limit) {
      NotEvaluable(id, "most cycles are as long as configured; pauses of no whole number of cycles move the mean");
      return;
    }
    Tell(id, configured, ppm, unsure);
  }

  void Tell(SlaveId id, TimeNs configured, double ppm, double unsure) {
    const sync::OutputRate& rate = context().sync().outputs(id).rate;
    if (Repeat(id, 0, rate.first()) != kNoFinding) return;
    const device::DeviceDescription& profile = *context().slave(id).profile;
    const auto& settings = context().sync().dc(id).last_active();
    const bool by_clock = settings && settings->activation.sync0();
    const auto& range = profile.sync.pll_range_ppm;
    Finding finding;
    finding.slave = id;
    finding.first = rate.first();
    finding.last = rate.last();
    if (settings) AddRelated(finding, settings->frame.number);
    finding.reference = ReferenceTo(range.source);
    const std::string deviation = Fixed(ppm, 0) + " ppm";
    const double mean_us = rate.mean_ns() / 1e3;
    finding.title = "The mean cycle is " + deviation + " off, the PLL follows " + std::to_string(*range) + " ppm";
    finding.message = "In OP " + Grouped(rate.cycles()) + " cycles have a mean of " + Fixed(mean_us, 3) + " us, " +
                      std::string(BaseText(rate.base())) + ": " + deviation + " from the configured " +
                      Fixed(static_cast<double>(configured) / 1e3, 3) + " us. " + LawText(profile) + " gives " +
                      std::to_string(*range) + " ppm as the range of the PLL. " +
                      (by_clock ? "Let the master's cycle follow the DC time."
                                : "Let the master send by a timer that keeps the configured cycle in the mean.");
    finding.evidence = {Real("deviation_ppm", ppm), Real("uncertainty_ppm", unsure), Real("mean_us", mean_us),
                        Real("configured_us", static_cast<double>(configured) / 1e3)};
    Report(0, std::move(finding));
  }

  std::set<SlaveId> judged_;  // in a run that has ended
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncRateDeviation>};

}  // namespace
}  // namespace ecaudit::sync_rate_deviation
