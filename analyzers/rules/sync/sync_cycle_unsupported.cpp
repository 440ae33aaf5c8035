#include <cmath>
#include <cstdlib>
#include <map>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::sync_cycle_unsupported {
namespace {

/// The observed cycle is judged from this many cycles in OP on.
constexpr std::uint64_t kEnoughCycles = 100;

constexpr RuleInfo kInfo{
    .id = "sync-cycle-unsupported",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .title = "The cycle time is one that the drive does not support",
    .needs = "the family's cycle times; SYNC0 cycle, object 60C2h or the rhythm of the process data",
    .source = "AKD-2011, 4.8 and 4.9; AKD-2010, 4.8 and 4.9; MKD, 4.9 and 4.10; PILZ, 4.6 and 4.7",
    .doc = R"(
## What it checks
The SYNC0 cycle (0x09A0) when SYNC is switched on, and the interpolation time (60C2h) when OP is requested: not
shorter than the family's shortest cycle (250 us), and a multiple of its base (62.5 us for AKD and MKD, 250 us for
Pilz). Process data in OP must not come faster than the shortest cycle either; and where neither SYNC0 nor 60C2h
says which cycle is meant, they must come at a multiple of the base, as near as the drive can follow.

## Why it matters
The drive cannot follow a cycle that is no multiple of its own: it refuses to synchronise, or its trajectory has
steps.

## How it is decided
SYNC0 cycle and 60C2h are exact numbers that the master wrote. The observed cycle is a mean over at least 100 cycles
in OP: too short with a tenth as margin, since its exact value depends on the clock; no multiple of the base when it
is further from the nearest one than the drive's PLL range and the precision of the clock (100 ppm) together. That is
inferred: the drive may be set not to synchronise. Where most cycles do keep to a multiple, the master is only late now
and then. A configured cycle is compared by sync-rate-deviation instead.

## Example
tests/rules/sync-cycle-unsupported/violates.trace

## What to do
Choose a cycle from the manual's list, and set 60C2h and the SYNC0 cycle to the same time.
)"};

class SyncCycleUnsupported final : public Rule {
 public:
  SyncCycleUnsupported() : Rule(kInfo) {
    Subscribe<sync::SyncSwitchedOn>(&SyncCycleUnsupported::On);
    Subscribe<model::AlRequestJudged>(&SyncCycleUnsupported::On);
    Subscribe<sync::RateEnded>(&SyncCycleUnsupported::On);
  }

  void On(const sync::SyncSwitchedOn& e) {
    if (!e.activation.sync0()) return;
    if (!e.sync0_cycle_ns) {
      NotEvaluable(e.slave, "SYNC0 cycle (0x09A0) not known", e.frame.number);
      return;
    }
    if (*e.sync0_cycle_ns != 0) {
      Check(e.slave, *e.sync0_cycle_ns, "SYNC0 cycle (0x09A0)", e.frame, 0);
    } else if (!context().slave(e.slave).profile->sync.source_with_dc.empty()) {
      ReportSinglePulse(e);
    }
  }

  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const auto cycle = model::InterpolationTime(context().slave(e.slave));
    if (cycle) Check(e.slave, *cycle, "interpolation time (60C2h)", e.request.frame, 1);
  }

  void On(const sync::RateEnded& e) { Observed(e.slave); }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) Observed(static_cast<SlaveId>(s));
  }

 private:
  /// The drive waits for a pulse in every cycle.
  void ReportSinglePulse(const sync::SyncSwitchedOn& e) {
    constexpr std::uint64_t kSinglePulse = 4;
    if (Repeat(e.slave, kSinglePulse, e.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title = "SYNC0 is switched on with a cycle of 0: one pulse, and no more";
    finding.message = "In frame " + std::to_string(e.frame.number) +
                      " SYNC0 is switched on while its cycle (0x09A0) is 0, which means a single pulse. The drive "
                      "synchronises to one in every cycle: write the cycle time before 0x0981.";
    finding.evidence = {Number("sync0_cycle_ns", 0)};
    Report(kSinglePulse, std::move(finding));
  }

  void Observed(SlaveId id) {
    const sync::OutputWatch& outputs = context().sync().outputs(id);
    const device::SyncDescription& family = context().slave(id).profile->sync;
    if (outputs.rate.cycles() < kEnoughCycles || !family.cycle_min.value) return;
    const auto mean = outputs.rate.mean_ns();
    if (!context().sync().Uncertainty(outputs.rate.base())) return;
    if (mean >= static_cast<double>(*family.cycle_min) * 0.9) {
      CheckMultiple(id, mean, outputs);
      return;
    }
    if (Repeat(id, 2, outputs.rate.first()) != kNoFinding) return;
    Finding finding;
    finding.slave = id;
    finding.first = outputs.rate.first();
    finding.last = outputs.rate.last();
    finding.reference = ReferenceTo(family.cycle_min.source);
    const std::string cycle = Duration(static_cast<std::int64_t>(mean));
    finding.title = "Process data come every " + cycle + ", faster than the drive supports";
    finding.message = "In OP the outputs come every " + cycle + " in the mean of " + Grouped(outputs.rate.cycles()) +
                      " cycles, " + std::string(BaseText(outputs.rate.base())) + ". " +
                      LawText(*context().slave(id).profile) + " gives " + Duration(*family.cycle_min) +
                      " as the shortest cycle. Choose a longer cycle.";
    finding.evidence = {Real("cycle_us", mean / 1e3), Number("cycle_min_ns", *family.cycle_min)};
    ReportOnce(id, 2, static_cast<TimeNs>(mean), std::move(finding));
  }

  /// @param mean  observed cycle in ns, not shorter than the family supports
  void CheckMultiple(SlaveId id, double mean, const sync::OutputWatch& outputs) {
    const model::SlaveModel& slave = context().slave(id);
    const device::SyncDescription& family = slave.profile->sync;
    const auto& settings = context().sync().dc(id).last_active();
    if ((settings && settings->activation.sync0()) || model::InterpolationTime(slave) || DriveCycle(slave)) return;
    if (!family.cycle_base.value || *family.cycle_base <= 0 || !family.pll_range_ppm.value) return;
    constexpr double kClockPpm = 100;
    const double base = static_cast<double>(*family.cycle_base);
    const double nearest = std::round(mean / base) * base;
    const double off_ppm = std::abs(mean / nearest - 1) * 1e6;
    if (off_ppm <= *family.pll_range_ppm + kClockPpm) return;
    // A master that polls between two cycles is late now and then, by no whole number of cycles.
    const auto usual = static_cast<double>(outputs.rate.usual());
    const double usual_nearest = std::max(std::round(usual / base), 1.0) * base;
    if (std::abs(usual / usual_nearest - 1) * 1e6 <= *family.pll_range_ppm) return;
    if (Repeat(id, 3, outputs.rate.first()) != kNoFinding) return;
    Finding finding;
    finding.slave = id;
    finding.first = outputs.rate.first();
    finding.last = outputs.rate.last();
    finding.confidence = Confidence::kInferred;
    finding.reference = ReferenceTo(family.cycle_base.source);
    const std::string cycle = Duration(static_cast<std::int64_t>(mean));
    finding.title = "Process data come every " + cycle + ", no multiple of " + Duration(*family.cycle_base);
    finding.message = "In OP the outputs come every " + cycle + " in the mean of " + Grouped(outputs.rate.cycles()) +
                      " cycles, " + std::string(BaseText(outputs.rate.base())) + "; the nearest multiple of " +
                      Duration(*family.cycle_base) + " is " + Duration(static_cast<std::int64_t>(nearest)) + ". " +
                      LawText(*slave.profile) + " lets the drive follow " + std::to_string(*family.pll_range_ppm) +
                      " ppm. Choose a multiple as the master's cycle, or do not let the drive synchronise to it.";
    finding.evidence = {Real("cycle_us", mean / 1e3), Number("cycle_base_ns", *family.cycle_base),
                        Number("pll_range_ppm", *family.pll_range_ppm)};
    Report(3, std::move(finding));
  }

  void Check(SlaveId id, TimeNs cycle, const std::string& what, const FrameRef& frame, std::uint64_t kind) {
    const device::DeviceDescription& profile = *context().slave(id).profile;
    const device::SyncDescription& family = profile.sync;
    if (!family.cycle_min.value && !family.cycle_base.value) {
      NotEvaluable(id, "the profile states no cycle times", frame.number);
      return;
    }
    const bool short_cycle = family.cycle_min.value && cycle < *family.cycle_min;
    const bool no_multiple = family.cycle_base.value && *family.cycle_base > 0 && cycle % *family.cycle_base != 0;
    if (!short_cycle && !no_multiple) return;
    const std::uint64_t key = kind << 62U | static_cast<std::uint64_t>(cycle);
    if (Repeat(id, key, frame) != kNoFinding) return;
    const auto& broken = short_cycle ? family.cycle_min : family.cycle_base;
    Finding finding;
    finding.slave = id;
    finding.first = frame;
    finding.reference = ReferenceTo(broken.source);
    finding.title =
        "The " + what + " is " + Duration(cycle) +
        (short_cycle ? ", shorter than the drive supports" : ", no multiple of " + Duration(*family.cycle_base));
    finding.message = "When frame " + std::to_string(frame.number) + " puts it to use, the " + what + " is " +
                      std::to_string(cycle) + " ns. " + LawText(profile) + " requires ";
    if (family.cycle_min.value) finding.message += "at least " + Duration(*family.cycle_min);
    if (family.cycle_base.value) {
      finding.message +=
          (family.cycle_min.value ? " and " : "") + std::string("multiples of ") + Duration(*family.cycle_base);
    }
    finding.message += ". Choose such a cycle for SYNC0, 60C2h and the process data alike.";
    finding.evidence = {Number("cycle_ns", cycle)};
    if (family.cycle_min.value) finding.evidence.push_back(Number("cycle_min_ns", *family.cycle_min));
    if (family.cycle_base.value) finding.evidence.push_back(Number("cycle_base_ns", *family.cycle_base));
    ReportOnce(id, key, cycle, std::move(finding));
  }

  /// The same cycle, wherever it shows next, follows from where it showed first.
  void ReportOnce(SlaveId id, std::uint64_t key, TimeNs cycle, Finding finding) {
    constexpr TimeNs kSame = 20;  // its part by which the mean of frames may differ
    const auto first = first_.find(id);
    const bool same = first != first_.end() && std::abs(first->second.cycle - cycle) <= first->second.cycle / kSame;
    if (same) finding.caused_by = first->second.finding;
    const FindingIndex index = Report(key, std::move(finding));
    if (first == first_.end() && index != kNoFinding) first_.emplace(id, First{cycle, index});
  }

  struct First {
    TimeNs cycle = 0;
    FindingIndex finding = kNoFinding;
  };
  std::map<SlaveId, First> first_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncCycleUnsupported>};

}  // namespace
}  // namespace ecaudit::sync_cycle_unsupported
