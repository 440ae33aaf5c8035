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

namespace ecaudit::sync_cycle_unsupported {
namespace {

/// The observed cycle is evaluated from this many cycles in OP on.
constexpr std::uint64_t kEnoughCycles = 100;

constexpr Word kCycleTimes{"cycle-times", "the cycle times that the drive supports", true};
constexpr Word kInterpolationTime{"interpolation-time", "the interpolation time (60C2h)"};

constexpr FindingKind kSinglePulse{
    .name = "single-pulse",
    .title = "SYNC0 is switched on with a cycle of 0: a single pulse",
    .message = R"({frame} switches SYNC0 on while its cycle (0x09A0) is {sync0_cycle_ns} ns, which means a single pulse.
The drive needs a pulse in every cycle.)",
    .next = "Write the cycle time before 0x0981."};

constexpr FindingKind kTooShort{
    .name = "too-short",
    .title = "{setting} is {cycle_ns} ns, less than {cycle_min_ns}",
    .message = R"({setting} is {cycle_ns} ns when {frame} [{?at_sync0}switches SYNC0 on][{!at_sync0}requests OP]. [The
manual ({manual})][{!manual}The EtherCAT standard] requires at least {cycle_min_ns}[ and multiples of
{cycle_base_ns}].)",
    .next = "Choose a supported cycle, the same for SYNC0, 60C2h and the process data.",
    .identity = "setting"};

constexpr FindingKind kNoMultiple{
    .name = "no-multiple",
    .title = "{setting} is {cycle_ns} ns, no multiple of {cycle_base_ns}",
    .message = R"({setting} is {cycle_ns} ns when {frame} [{?at_sync0}switches SYNC0 on][{!at_sync0}requests OP]. [The
manual ({manual})][{!manual}The EtherCAT standard] requires [at least {cycle_min_ns} and ]multiples of
{cycle_base_ns}.)",
    .next = "Choose a supported cycle, the same for SYNC0, 60C2h and the process data.",
    .identity = "setting"};

constexpr FindingKind kNoCycle{
    .name = "no-cycle",
    .title = "60C2h: {units:number} x 10^{power} s is no cycle time",
    .message =
        R"(When OP is requested in {frame}, 60C2h:1 (interpolation time units) is {units}, as
[{?units_written}written][{!units_written}read] in {units_frame}. 60C2h:2 (interpolation time index) is {power}, as
[{?power_written}written][{!power_written}read] in {power_frame}. The index is the power of ten of the time: -3 means
milliseconds.[{?zero} 0 units are no time.][{!zero} {units} x 10^{power} s is [{?long}1 s or more][{!long}less than 1
us].] [The manual ({manual})][{!manual}The EtherCAT standard] requires at least {cycle_min_ns}.)",
    .next =
        "Write a negative exponent (INT8) to 60C2h:2 and the number of units to 60C2h:1: 2 ms is (2, -3) or (20, -4).",
    .identity = "units power"};

constexpr FindingKind kFramesTooFast{
    .name = "frames-too-fast",
    .title = "Process data every {cycle_us}, but the shortest cycle is {cycle_min_ns}",
    .message = R"(In OP the outputs come every {cycle_us} (mean of {cycles}, by {time_base}). [The manual
({manual})][{!manual}The EtherCAT standard] gives {cycle_min_ns} as the shortest cycle.)",
    .next = "Choose a longer cycle."};

constexpr FindingKind kFramesNoMultiple{
    .name = "frames-no-multiple",
    .title = "Process data every {cycle_us}, no multiple of {cycle_base_ns}",
    .message = R"(In OP the outputs come every {cycle_us} (mean of {cycles}, by {time_base}). The nearest multiple of
{cycle_base_ns} is {nearest_us}. [The manual ({manual})][{!manual}The EtherCAT standard] lets the drive follow a
deviation of {pll_range_ppm} ppm.)",
    .next = "Choose a multiple as the cycle of the master, or do not let the drive synchronise to it."};

constexpr const FindingKind* kKinds[] = {&kSinglePulse, &kTooShort,      &kNoMultiple,
                                         &kNoCycle,     &kFramesTooFast, &kFramesNoMultiple};
constexpr Word kOtherPart{"interpolation-time-part", "one of 60C2h:1 (units) and 60C2h:2 (power of ten)"};

constexpr RuleInfo kInfo{
    .id = "sync-cycle-unsupported",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .title = "The drive does not support the cycle time",
    .needs = "the cycle times of the family; SYNC0 cycle, object 60C2h or the rhythm of the process data",
    .source = "AKD-2011, 4.8 and 4.9; AKD-2010, 4.8 and 4.9; MKD, 4.9 and 4.10; PILZ, 4.6 and 4.7",
    .kinds = kKinds,
    .doc = R"(
## What it checks
- The SYNC0 cycle (0x09A0) when SYNC0 is switched on, and the interpolation time (60C2h) when OP is requested. Both must
  not be shorter than the shortest cycle of the family (250 us), and must be a multiple of its base (62.5 us for AKD and
  MKD, 250 us for Pilz).
- Process data in OP: they must not come faster than the shortest cycle.
- If neither SYNC0 nor 60C2h gives the cycle, process data must come at a multiple of the base, as near as the drive can
  follow.

## Why it matters
The drive cannot follow a cycle that is no multiple of its own: it refuses to synchronise, or its trajectory has steps.

## How it is decided
- SYNC0 cycle and 60C2h are exact numbers. The master wrote the SYNC0 cycle and at least one part of 60C2h; it wrote or
  read the other part.
- 60C2h:1 (units) and 60C2h:2 (power of ten) must make a time: 0 units, an exponent above -1 (3 instead of -3) and one
  below -9 make none. If the master wrote only one of them and never read the other one, 60C2h is not evaluated.
- The observed cycle is a mean over at least 100 cycles in OP.
- It is too short if it is below nine tenths of the shortest cycle: the exact value depends on the clock.
- It is no multiple if it differs from the nearest one by more than the PLL range of the drive and the precision of the
  clock (100 ppm) together. That is inferred: the drive may be configured not to synchronise.
- If most cycles keep to a multiple, the master is only late now and then. That is not reported.
- If a cycle is configured, sync-rate-deviation compares it.

## Example
tests/rules/sync-cycle-unsupported/violates.trace

## What to do
Choose a cycle from the list in the manual, and set 60C2h and the SYNC0 cycle to the same time.
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
    if (!e.sync0_cycle_ns) return NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kSync0Cycle, e.frame.number);
    if (*e.sync0_cycle_ns != 0) {
      Check(e.slave, *e.sync0_cycle_ns, what::kSync0Cycle, e.frame, 0);
    } else if (!context().slave(e.slave).profile->sync.source_with_dc.empty()) {
      ReportSinglePulse(e);
    }
  }

  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const auto cycle = model::InterpolationTime(context().slave(e.slave));
    if (cycle) {
      Check(e.slave, *cycle, kInterpolationTime, e.request.frame, 1);
    } else {
      CheckParts(e.slave, e.request.frame);
    }
  }

  void On(const sync::RateEnded& e) { Observed(e.slave); }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) Observed(static_cast<SlaveId>(s));
  }

 private:
  /// The drive waits for a pulse in every cycle.
  void ReportSinglePulse(const sync::SyncSwitchedOn& e) {
    constexpr std::uint64_t kKey = 4;
    if (Repeat(e.slave, kKey, e.frame) != kNoFinding) return;
    Finding finding = Found(kSinglePulse, e.slave, e.frame);
    finding.Set("sync0_cycle_ns", arg::Number(0));
    Report(kKey, std::move(finding));
  }

  /// Units and exponent that make no time, or of which the master wrote one only.
  void CheckParts(SlaveId id, const FrameRef& frame) {
    constexpr std::uint16_t kObject = 0x60C2;
    const model::SlaveModel& slave = context().slave(id);
    const device::SyncDescription& family = slave.profile->sync;
    if (!family.cycle_by_60c2.value.value_or(false) || !family.cycle_min.value) return;
    const model::ObjectValue* units = slave.objects.Find(kObject, 1);
    const model::ObjectValue* power = slave.objects.Find(kObject, 2);
    // Values of the drive alone are its own affair.
    if ((units == nullptr || !units->written) && (power == nullptr || !power->written)) return;
    if (units == nullptr || power == nullptr) {
      NotEvaluable(id, ReasonCode::kNotInCapture, kOtherPart, frame.number);
      return;
    }
    const std::int64_t exponent = power->as_signed();
    const bool sensible = exponent >= -9 && exponent <= -1 && units->raw != 0;
    if (sensible) return;
    constexpr std::uint64_t kKey = 5;
    if (Repeat(id, kKey, frame) != kNoFinding) return;
    Finding finding = Found(kNoCycle, id, frame);
    AddRelated(finding, units->since);
    AddRelated(finding, power->since);
    finding.reference = ReferenceTo(family.cycle_by_60c2.source);
    finding.Set("units", arg::Number(static_cast<std::int64_t>(units->raw)))
        .Set("power", arg::Number(exponent))
        .Set("units_written", arg::Flag(units->written))
        .Set("units_frame", arg::Frame(units->since))
        .Set("power_written", arg::Flag(power->written))
        .Set("power_frame", arg::Frame(power->since))
        .Set("zero", arg::Flag(units->raw == 0))
        .Set("long", arg::Flag(exponent >= 0))
        .Set("cycle_min_ns", arg::Ns(*family.cycle_min));
    SetManual(finding, *slave.profile);
    Report(kKey, std::move(finding));
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
    Finding finding = Found(kFramesTooFast, id, outputs.rate.first());
    finding.last = outputs.rate.last();
    finding.reference = ReferenceTo(family.cycle_min.source);
    SetObserved(finding, outputs);
    finding.Set("cycle_min_ns", arg::Ns(*family.cycle_min));
    SetManual(finding, *context().slave(id).profile);
    ReportOnce(id, 2, static_cast<TimeNs>(mean), std::move(finding));
  }

  static void SetObserved(Finding& finding, const sync::OutputWatch& outputs) {
    finding.Set("cycle_us", arg::Us(static_cast<TimeNs>(outputs.rate.mean_ns())))
        .Set("cycles", arg::Count(outputs.rate.cycles(), "cycle"))
        .Set("time_base", arg::Of(WordOf(outputs.rate.base())));
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
    Finding finding = Found(kFramesNoMultiple, id, outputs.rate.first());
    finding.last = outputs.rate.last();
    finding.confidence = Confidence::kInferred;
    finding.reference = ReferenceTo(family.cycle_base.source);
    SetObserved(finding, outputs);
    finding.Set("cycle_base_ns", arg::Ns(*family.cycle_base))
        .Set("nearest_us", arg::Us(static_cast<TimeNs>(nearest)))
        .Set("pll_range_ppm", arg::Number(*family.pll_range_ppm));
    SetManual(finding, *slave.profile);
    Report(3, std::move(finding));
  }

  void Check(SlaveId id, TimeNs cycle, const Word& setting, const FrameRef& frame, std::uint64_t kind) {
    const device::DeviceDescription& profile = *context().slave(id).profile;
    const device::SyncDescription& family = profile.sync;
    if (!family.cycle_min.value && !family.cycle_base.value) {
      NotEvaluable(id, ReasonCode::kNotInProfile, kCycleTimes, frame.number);
      return;
    }
    const bool short_cycle = family.cycle_min.value && cycle < *family.cycle_min;
    const bool no_multiple = family.cycle_base.value && *family.cycle_base > 0 && cycle % *family.cycle_base != 0;
    if (!short_cycle && !no_multiple) return;
    const std::uint64_t key = kind << 62U | static_cast<std::uint64_t>(cycle);
    if (Repeat(id, key, frame) != kNoFinding) return;
    const auto& broken = short_cycle ? family.cycle_min : family.cycle_base;
    Finding finding = Found(short_cycle ? kTooShort : kNoMultiple, id, frame);
    finding.reference = ReferenceTo(broken.source);
    finding.Set("setting", arg::Of(setting))
        .Set("cycle_ns", arg::Number(cycle))
        .Set("at_sync0", arg::Flag(&setting == &what::kSync0Cycle));
    if (family.cycle_min.value) finding.Set("cycle_min_ns", arg::Ns(*family.cycle_min));
    if (family.cycle_base.value) finding.Set("cycle_base_ns", arg::Ns(*family.cycle_base));
    SetManual(finding, profile);
    ReportOnce(id, key, cycle, std::move(finding));
  }

  /// The same cycle in another place has its first place as its cause.
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
