#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::sync_cycle_mismatch {
namespace {

constexpr std::uint64_t kEnoughCycles = 50;
constexpr std::uint16_t kInterpolationTime = 0x60C2;

constexpr Word kInterpolation{"interpolation-time", "the interpolation time (60C2h)"};
constexpr Word kConfiguredCycle{"configured-cycle", "the configured cycle"};
constexpr Word kCyclesInOp{"cycles-in-op", "cycles with process data in OP (50 needed)", true};

constexpr FindingKind kSync0AndInterpolation{
    .name = "sync0-cycle-interpolation-time",
    .title = "SYNC0 cycle is {sync0_cycle_ns}, but 60C2h gives {interpolation_ns}",
    .message =
        R"([{?changed_in_op}The master changed 60C2h in OP (last in {frame}).][{!changed_in_op}The master requests OP
in {frame}.] The SYNC0 cycle (0x09A0) is then {sync0_cycle_ns}[ (since {sync0_frame})], but the interpolation time
(60C2h) is {interpolation_ns}[ (since {interpolation_frame})].)",
    .next = "Set the same time in both."};

constexpr FindingKind kSync0AndDrive{
    .name = "sync0-cycle-drive-cycle",
    .title = "SYNC0 cycle is {sync0_cycle_ns}, but {parameter} gives {drive_cycle_ns}",
    .message =
        R"([{?changed_in_op}The master changed 60C2h in OP (last in {frame}).][{!changed_in_op}The master requests OP
in {frame}.] The SYNC0 cycle (0x09A0) is then {sync0_cycle_ns}[ (since {sync0_frame})], but {parameter} gives
{drive_cycle_ns}. It is {parameter_count}, as given by --parameter, and counts {cycle_base_ns} ({parameter_source}).)",
    .next = "Set the same time in both.",
    .identity = "parameter"};

constexpr FindingKind kInterpolationAndDrive{
    .name = "interpolation-time-drive-cycle",
    .title = "60C2h gives {interpolation_ns}, but {parameter} gives {drive_cycle_ns}",
    .message =
        R"([{?changed_in_op}The master changed 60C2h in OP (last in {frame}).][{!changed_in_op}The master requests OP
in {frame}.] The interpolation time (60C2h) is then {interpolation_ns}[ (since {interpolation_frame})], but
{parameter} gives {drive_cycle_ns}. It is {parameter_count}, as given by --parameter, and counts {cycle_base_ns}
({parameter_source}).)",
    .next = "Set the same time in both.",
    .identity = "parameter"};

constexpr FindingKind kRewritten{
    .name = "sync0-cycle-rewritten",
    .title = "SYNC0 runs with {sync0_cycle_ns}, but 0x09A0 is now {sync0_cycle_now_ns} ns",
    .message =
        R"(SYNC0 was switched on with a cycle of {sync0_cycle_ns} in {sync0_frame}. While it was on, the master
wrote {sync0_cycle_now_ns} ns to 0x09A0 in {frame}.)",
    .next = "Use one time: write the cycle before SYNC0 is switched on, and do not change it afterwards."};

constexpr FindingKind kProcessData{
    .name = "process-data-cycle",
    .title = "Process data every {observed_us}, but the configured cycle is {configured_us}",
    .message =
        R"(In OP the outputs of this slave come every {observed_us}. That is the mean of {cycles} from {frame} to
{end_frame}, by {time_base}. {setting} is [{parameter_count}, which means
{parameter_count} x {cycle_base_ns} = {configured_us} ({parameter_source})][{!parameter_count}{configured_ns} ns].[{?one_per_cycle} The drive needs one frame in each
cycle.][{!one_per_cycle} The observed cycle is neither a multiple nor a part of it.])",
    .next = "Let the master run with the configured cycle, or configure the cycle that it runs with."};

constexpr FindingKind kInterpolatedPositions{
    .name = "process-data-interpolation-time",
    .title = "Process data every {observed_us}, but 60C2h gives {configured_us}",
    .message =
        R"(In OP the outputs of this slave come every {observed_us}. That is the mean of {cycles} from {frame} to
{end_frame}, by {time_base}. The master wrote {configured_us} to 60C2h ({interpolation_frame}), the time between two set
points by CiA 402. A drive that interpolates positions over this time stops between two of them, or never reaches
them: the axis vibrates. Whether this drive does so is not known.)",
    .next = "Write the cycle of the master to 60C2h.",
    .identity = ""};

constexpr FindingKind kOtherRhythm{
    .name = "rhythm-not-accepted",
    .title = "Process data every {observed_us}, but SYNC0 every {configured_us}: sync error",
    .message =
        R"(In OP the outputs of this slave come every {observed_us}. That is the mean of {cycles} from {frame} to
{end_frame}, by {time_base}. SYNC0 comes every {configured_us} ({sync0_frame}). Many slaves accept that, but this one
reports in {report_frame} that it lost synchronisation ({report}).)",
    .next = "Write the cycle of the process data to 0x09A0, or let the master run with the SYNC0 cycle.",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {
    &kSync0AndInterpolation, &kSync0AndDrive, &kInterpolationAndDrive, &kRewritten, &kProcessData,
    &kInterpolatedPositions, &kOtherRhythm};

constexpr RuleInfo kInfo{.id = "sync-cycle-mismatch",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .of_family = true,
                         .subject = Subject::kCycle,
                         .title = "SYNC0 cycle, interpolation time and cycle of the process data disagree",
                         .needs =
                             "two of: SYNC0 cycle (0x09A0), object 60C2h, the cycle of the drive itself (--parameter), "
                             "at least 50 cycles of process data in OP",
                         .source = "ESC-1, distributed clocks; AKD-2011, 4.8; MKD, 4.9; PILZ, 4.6",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
That these are the same time:

- the SYNC0 cycle (0x09A0),
- the interpolation time that the master wrote (60C2h),
- the distance of the process data in OP,
- the cycle of the drive itself, if it was given: FBUS.SAMPLEPERIOD (AKD, MKD) or PTBASE (Pilz).

## Why it matters
The drive interpolates its setpoints over 60C2h and executes them with SYNC0. If frames come in another rhythm, it
repeats setpoints or skips them. The axis is jerky, follows with a wrong velocity or loses synchronisation.

## How it is decided
- SYNC0 cycle and 60C2h are compared exactly when OP is requested, and again if one of them was written in OP. 60C2h
  counts for families that take the cycle from it.
- The process data count as the mean over the cycles in OP, by the DC time in the frames or by good stamps. They
  disagree if they differ by more than a tenth.
- A new mean begins when the slave leaves OP, when SYNC0 is switched off, and when the frames come in another rhythm.
- If the capture misses packets among these cycles, the finding is inferred. If it misses some between the setting and
  the first cycle, the setting may have changed: that is not evaluated.
- SAMPLEPERIOD and PTBASE are no objects: only --parameter gives them.
- If the process data match one of two settings that disagree, the other setting is wrong. caused_by then names the
  finding about the settings.
- If a family is not known to take its cycle from 60C2h, this object counts in the modes 7 and 8 (positions). A
  difference is then an info.
- If a family is not known to need one frame a cycle, SYNC0 may be a multiple of the frame cycle or a part of it. If the
  slave then reports in OP that it lost synchronisation (emergency 0x87xx, AL status codes such as 0x001A), that is an
  inferred warning.

## Example
tests/rules/sync-cycle-mismatch/violates.trace

## What to do
Set one cycle time in the configuration of the master, and let it write 0x09A0 and 60C2h from it.
)"};

class SyncCycleMismatch final : public Rule {
 public:
  SyncCycleMismatch() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&SyncCycleMismatch::On);
    Subscribe<sync::SlaveRunEnded>(&SyncCycleMismatch::On);
    Subscribe<sync::RateEnded>(&SyncCycleMismatch::On);
    Subscribe<mailbox::SdoTransfer>(&SyncCycleMismatch::On);
    Subscribe<mailbox::Emergency>(&SyncCycleMismatch::On);
    Subscribe<model::DriveFaultExplained>(&SyncCycleMismatch::On);
    Subscribe<model::AlErrorCode>(&SyncCycleMismatch::On);
  }

  // What the slave itself reports of its synchronisation.
  void On(const mailbox::Emergency& e) { Complain(e.slave, e.data.error_code, kSyncController, e.frame); }
  void On(const model::DriveFaultExplained& e) {
    if (e.source == model::DriveFaultExplained::Source::kErrorCode) {
      Complain(e.slave, static_cast<std::uint16_t>(e.code & 0xFFFFU), kSyncController, e.frame);
    }
  }
  void On(const model::AlErrorCode& e) {
    if (esc::SpeaksOfSynchronisation(e.code)) Complain(e.slave, e.code, 0, e.frame);
  }

  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
      CompareChanged(e.slave);
      return;
    }
    Compare(e.slave, SettingsOf(e.slave), e.request.frame, false);
  }

  /// Units and exponent of the interpolation time are written one after the other: they are compared later.
  void On(const mailbox::SdoTransfer& t) {
    const bool changes = t.has_object && t.index == kInterpolationTime && t.service == mailbox::SdoService::kDownload &&
                         t.outcome == mailbox::SdoOutcome::kCompleted;
    if (!changes || !context().slave(t.slave).al.SettledIn(esc::AlState::OP)) return;
    changed_in_op_[t.slave] = t.last;
  }

  void On(const sync::SlaveRunEnded& e) { CompareChanged(e.slave); }

  void On(const sync::RateEnded& e) {
    if (context().sync().outputs(e.slave).rate.cycles() < kEnoughCycles) return;
    evaluated_.insert(e.slave);
    NoteRhythm(e.slave);
    Observed(e.slave);
    ObservedByStandard(e.slave);
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      CompareChanged(id);
      NoteRhythm(id);
      if (context().sync().outputs(id).rate.cycles() >= kEnoughCycles || !evaluated_.contains(id)) Observed(id);
      ObservedByStandard(id);
    }
    for (const auto& [id, complaint] : complaints_) ReportRhythm(id, complaint);
  }

 private:
  static constexpr std::uint8_t kSyncController = 0x87;  ///< high byte of the error codes about it
  struct Complaint {
    std::uint16_t code = 0;
    FrameRef frame;
  };
  /// Process data in another rhythm than SYNC0, in a run of cycles.
  struct Rhythm {
    TimeNs observed = 0, configured = 0;
    FrameRef first, last, sync0;
    std::uint64_t cycles = 0;
    sync::TimeBase base = sync::TimeBase::kCapture;
  };

  void Complain(SlaveId slave, std::uint16_t code, std::uint8_t group, const FrameRef& frame) {
    if (group == 0 || code >> 8U == group) complaints_.try_emplace(slave, Complaint{code, frame});
  }

  /// Keeps the first run whose cycles differ from SYNC0.
  void NoteRhythm(SlaveId id) {
    const sync::OutputWatch& outputs = context().sync().outputs(id);
    const sync::DcUnit& unit = context().sync().dc(id);
    const auto& settings = unit.active() ? unit.active() : unit.last_active();
    if (rhythms_.contains(id) || outputs.rate.cycles() < kEnoughCycles || !settings) return;
    if (!settings->activation.sync0() || settings->sync0_cycle_ns.value_or(0) <= 0) return;
    if (NeedsOneFrameACycle(context().slave(id)) || !context().sync().Uncertainty(outputs.rate.base())) return;
    const TimeNs configured = *settings->sync0_cycle_ns;
    const double off = std::abs(outputs.rate.mean_ns() / static_cast<double>(configured) - 1);
    if (off - outputs.rate.JitterShare() <= kCycleTolerance) return;
    rhythms_.try_emplace(id, Rhythm{static_cast<TimeNs>(outputs.rate.mean_ns()), configured, outputs.rate.first(),
                                    outputs.rate.last(), settings->frame, outputs.rate.cycles(), outputs.rate.base()});
  }

  void ReportRhythm(SlaveId id, const Complaint& complaint) {
    const auto found = rhythms_.find(id);
    if (found == rhythms_.end() || found->second.first.number > complaint.frame.number) return;
    const Rhythm& rhythm = found->second;
    constexpr std::uint64_t kKey = 6;
    for (const ecaudit::Finding& other : context().store.findings()) {
      if (other.rule == kInfo.id && other.slave == id && other.severity != Severity::kInfo) return;
    }
    Finding finding = Found(kOtherRhythm, id, rhythm.first);
    finding.last = rhythm.last;
    finding.confidence = Confidence::kInferred;
    AddRelated(finding, rhythm.sync0.number);
    AddRelated(finding, complaint.frame.number);
    finding.Set("observed_us", arg::Us(rhythm.observed))
        .Set("configured_us", arg::Us(rhythm.configured))
        .Set("sync0_frame", arg::Frame(rhythm.sync0.number))
        .Set("cycles", arg::Count(rhythm.cycles, "cycle"))
        .Set("end_frame", arg::Frame(rhythm.last.number))
        .Set("time_base", arg::Of(WordOf(rhythm.base)))
        .Set("report", arg::Hex(complaint.code, 4))
        .Set("report_frame", arg::Frame(complaint.frame.number));
    (void)Report(kKey, Severity::kWarning, std::move(finding));
  }

  /// One of the places where the cycle is set, as it is now.
  struct Setting {
    enum class Place : std::uint8_t { kInterpolation, kSync0, kDrive };
    Place place = Place::kSync0;
    TimeNs time = 0;
    FrameNo since = 0;  ///< 0: given by the user
    std::string source;
  };

  [[nodiscard]] std::vector<Setting> SettingsOf(SlaveId id) const {
    const model::SlaveModel& slave = context().slave(id);
    const device::SyncDescription& family = slave.profile->sync;
    std::vector<Setting> settings;
    const auto& active = context().sync().dc(id).active();
    if (active && active->activation.sync0() && active->sync0_cycle_ns.value_or(0) > 0) {
      settings.push_back(
          {Setting::Place::kSync0, *active->sync0_cycle_ns, active->frame.number, family.cycle_base.source});
    }
    const auto interpolation = model::InterpolationTime(slave);
    if (interpolation && family.cycle_by_60c2.value.value_or(false)) {
      settings.push_back({Setting::Place::kInterpolation, *interpolation,
                          slave.objects.Find(kInterpolationTime, 1)->since, family.cycle_by_60c2.source});
    }
    if (const auto drive = DriveCycle(slave)) {
      settings.push_back({Setting::Place::kDrive, *drive, 0, family.cycle_count->source});
    }
    return settings;
  }

  void Compare(SlaveId slave, const std::vector<Setting>& settings, const FrameRef& frame, bool changed_in_op) {
    for (std::size_t i = 1; i < settings.size(); ++i) {
      if (settings[i].time != settings[0].time) ReportSettings(slave, settings[0], settings[i], frame, changed_in_op);
    }
  }

  /// What was changed while the slave was in OP.
  void CompareChanged(SlaveId slave) {
    if (const auto changed = changed_in_op_.find(slave); changed != changed_in_op_.end()) {
      Compare(slave, SettingsOf(slave), changed->second, true);
      changed_in_op_.erase(changed);
    }
    const sync::DcUnit& unit = context().sync().dc(slave);
    const auto& active = unit.active();
    const auto& rewritten = unit.cycle_rewritten();
    if (!active || !active->activation.sync0() || !active->sync0_cycle_ns || !rewritten) return;
    if (!context().slave(slave).al.operated()) return;
    constexpr std::uint64_t kKey = 4;
    if (Repeat(slave, kKey, rewritten->frame) != kNoFinding) return;
    Finding finding = Found(kRewritten, slave, rewritten->frame);
    AddRelated(finding, active->frame.number);
    finding.reference = ReferenceTo(context().slave(slave).profile->sync.cycle_base.source);
    const TimeNs before = *active->sync0_cycle_ns;
    finding.Set("sync0_cycle_ns", arg::Ns(before))
        .Set("sync0_cycle_now_ns", arg::Number(rewritten->ns))
        .Set("sync0_frame", arg::Frame(active->frame.number));
    ReportAndKeep(slave, kKey, before, rewritten->ns, std::move(finding));
  }

  void ReportAndKeep(SlaveId slave, std::uint64_t key, TimeNs one, TimeNs other, Finding finding) {
    const FindingIndex index = Report(key, std::move(finding));
    if (index != kNoFinding) odd_settings_[slave].push_back({one, other, index});
  }

  [[nodiscard]] static const FindingKind& KindOf(const Setting& one, const Setting& other) {
    if (other.place == Setting::Place::kInterpolation) return kSync0AndInterpolation;
    return one.place == Setting::Place::kSync0 ? kSync0AndDrive : kInterpolationAndDrive;
  }

  /// A parameter that counts periods of the drive.
  void SetParameter(Finding& finding, TimeNs cycle) const {
    const device::SyncDescription& family = context().slave(finding.slave).profile->sync;
    finding.Set("parameter_count", arg::Number(cycle / *family.cycle_base))
        .Set("cycle_base_ns", arg::Ns(*family.cycle_base))
        .Set("parameter_source", arg::Text(family.cycle_count->source));
  }

  void SetSetting(Finding& finding, const Setting& setting) const {
    switch (setting.place) {
      case Setting::Place::kSync0:
        finding.Set("sync0_cycle_ns", arg::Ns(setting.time)).Set("sync0_frame", arg::Frame(setting.since));
        break;
      case Setting::Place::kInterpolation:
        finding.Set("interpolation_ns", arg::Ns(setting.time)).Set("interpolation_frame", arg::Frame(setting.since));
        break;
      case Setting::Place::kDrive:
        finding.Set("drive_cycle_ns", arg::Ns(setting.time))
            .Set("parameter", arg::Text(context().slave(finding.slave).profile->sync.cycle_count->keyword));
        SetParameter(finding, setting.time);
        break;
    }
    AddRelated(finding, setting.since);
  }

  void ReportSettings(SlaveId slave, const Setting& one, const Setting& other, const FrameRef& frame,
                      bool changed_in_op) {
    const auto key = static_cast<std::uint64_t>(other.place);
    if (Repeat(slave, key, frame) != kNoFinding) return;
    Finding finding = Found(KindOf(one, other), slave, frame);
    SetSetting(finding, one);
    SetSetting(finding, other);
    finding.reference = ReferenceTo(other.source);
    finding.Set("changed_in_op", arg::Flag(changed_in_op));
    ReportAndKeep(slave, key, one.time, other.time, std::move(finding));
  }

  /// The finding that reports already that this setting differs from another one, which the process data keep to: one
  /// wrong value is one cause.
  [[nodiscard]] FindingIndex CauseOf(SlaveId slave, TimeNs configured, double observed) const {
    const auto reported = odd_settings_.find(slave);
    if (reported == odd_settings_.end()) return kNoFinding;
    const auto kept = [observed](TimeNs time) {
      return std::abs(observed / static_cast<double>(time) - 1) <= kCycleTolerance;
    };
    for (const OddSetting& odd : reported->second) {
      if ((odd.one == configured && kept(odd.other)) || (odd.other == configured && kept(odd.one))) return odd.index;
    }
    return kNoFinding;
  }

  void Observed(SlaveId id) {
    const model::SlaveModel& slave = context().slave(id);
    // Of a run that ended unevaluated the settings still show that there was something to evaluate.
    const sync::DcUnit& unit = context().sync().dc(id);
    const bool ended = context().sync().outputs(id).rate.cycles() == 0;
    const auto& settings = ended ? unit.activated() : unit.last_active();
    const auto interpolation = model::InterpolationTime(slave);
    const auto drive = DriveCycle(slave);
    TimeNs configured = 0;
    FrameNo since = 0;  // 0: given by the user
    Value setting = arg::Of(what::kSync0Cycle);
    bool by_parameter = false;
    if (settings && settings->activation.sync0() && settings->sync0_cycle_ns.value_or(0) > 0) {
      configured = *settings->sync0_cycle_ns;
      since = settings->frame.number;
    } else if (interpolation && slave.profile->sync.cycle_by_60c2.value.value_or(false)) {
      configured = *interpolation;
      since = slave.objects.Find(kInterpolationTime, 1)->since;
      setting = arg::Of(kInterpolation);
    } else if (drive) {
      configured = *drive;
      setting = arg::Text(slave.profile->sync.cycle_count->keyword);
      by_parameter = true;
    }
    if (configured == 0) return;
    const sync::OutputWatch& outputs = context().sync().outputs(id);
    if (outputs.rate.cycles() < kEnoughCycles) return NotEvaluable(id, ReasonCode::kTooFew, kCyclesInOp);
    if (!context().sync().Uncertainty(outputs.rate.base())) {
      NotEvaluable(id, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming);
      return;
    }
    const auto mean = outputs.rate.mean_ns();
    const double off = CycleDeviation(slave, mean, configured);
    if (off <= kCycleTolerance) return;
    if (off - outputs.rate.JitterShare() <= kCycleTolerance) {
      NotEvaluable(id, ReasonCode::kTooIrregular, what::kProcessDataTiming);
      return;
    }
    const track::Network& network = context().network();
    const FrameNo begin = outputs.rate.first().number;
    if (since != 0 && network.MissesBetween(since, begin)) {
      NotEvaluable(id, ReasonCode::kCaptureGap, kConfiguredCycle, begin);
      return;
    }
    if (Repeat(id, 3, outputs.rate.first()) != kNoFinding) return;
    Finding finding = Found(kProcessData, id, outputs.rate.first());
    // The cycle of a slave in OP is hardly ever set again.
    if (since != 0 && network.MissesBetween(begin, outputs.rate.last().number))
      finding.confidence = Confidence::kInferred;
    finding.last = outputs.rate.last();
    finding.caused_by = CauseOf(id, configured, mean);
    if (settings) AddRelated(finding, settings->frame.number);
    finding.Set("observed_us", arg::Us(static_cast<TimeNs>(mean)))
        .Set("configured_us", arg::Us(configured))
        .Set("configured_ns", arg::Number(configured))
        .Set("setting", std::move(setting))
        .Set("cycles", arg::Count(outputs.rate.cycles(), "cycle"))
        .Set("end_frame", arg::Frame(outputs.rate.last().number))
        .Set("time_base", arg::Of(WordOf(outputs.rate.base())))
        .Set("one_per_cycle", arg::Flag(NeedsOneFrameACycle(slave)));
    if (by_parameter) {
      SetParameter(finding, configured);
      finding.reference = ReferenceTo(slave.profile->sync.cycle_count->source);
    }
    Report(3, std::move(finding));
  }

  /// CiA 402 gives 60C2h this meaning; what a drive of an unknown family does with it is not known.
  void ObservedByStandard(SlaveId id) {
    const model::SlaveModel& slave = context().slave(id);
    const auto interpolation = model::InterpolationTime(slave);
    if (!interpolation || slave.profile->sync.cycle_by_60c2.value) return;
    static constexpr std::int8_t kInterpolatedMode = 7, kCyclicPosition = 8;
    const bool positions = slave.drives.Any([](const model::DriveUnit& unit) {
      const auto mode = unit.modes().shown() ? unit.modes().shown() : unit.modes().requested();
      return mode && (*mode == kInterpolatedMode || *mode == kCyclicPosition);
    });
    const auto& rate = context().sync().outputs(id).rate;
    if (!positions || rate.cycles() < kEnoughCycles || !context().sync().Uncertainty(rate.base())) return;
    const model::ObjectValue* const object = slave.objects.Find(kInterpolationTime, 1);
    if (object == nullptr || object->since > rate.first().number) return;  // written in this run
    const auto mean = rate.mean_ns();
    const double off = std::abs(mean / static_cast<double>(*interpolation) - 1);
    if (off - rate.JitterShare() <= kCycleTolerance) return;
    if (context().network().MissesBetween(object->since, rate.first().number)) return;
    constexpr std::uint64_t kKey = 5;
    if (Repeat(id, kKey, rate.first()) != kNoFinding) return;
    Finding finding = Found(kInterpolatedPositions, id, rate.first());
    finding.last = rate.last();
    finding.confidence = Confidence::kInferred;
    AddRelated(finding, object->since);
    finding.Set("observed_us", arg::Us(static_cast<TimeNs>(mean)))
        .Set("configured_us", arg::Us(*interpolation))
        .Set("interpolation_frame", arg::Frame(object->since))
        .Set("cycles", arg::Count(rate.cycles(), "cycle"))
        .Set("end_frame", arg::Frame(rate.last().number))
        .Set("time_base", arg::Of(WordOf(rate.base())));
    Report(kKey, Severity::kInfo, std::move(finding));
  }

  /// Two settings that a finding compares.
  struct OddSetting {
    TimeNs one = 0, other = 0;
    FindingIndex index = kNoFinding;
  };

  std::map<SlaveId, FrameRef> changed_in_op_;
  std::map<SlaveId, std::vector<OddSetting>> odd_settings_;
  std::map<SlaveId, Complaint> complaints_;  // the first one each
  std::map<SlaveId, Rhythm> rhythms_;
  std::set<SlaveId> evaluated_;  // in a run that has ended
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncCycleMismatch>};

}  // namespace
}  // namespace ecaudit::sync_cycle_mismatch
