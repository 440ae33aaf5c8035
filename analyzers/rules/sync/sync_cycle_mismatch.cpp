#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

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
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::sync_cycle_mismatch {
namespace {

constexpr std::uint64_t kEnoughCycles = 50;
constexpr std::uint16_t kInterpolationTime = 0x60C2;
/// Deviations up to this are a matter of sync-rate-deviation and of the master's jitter.
constexpr double kTolerance = 0.1;

constexpr RuleInfo kInfo{.id = "sync-cycle-mismatch",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .of_family = true,
                         .subject = Subject::kCycle,
                         .title = "SYNC0 cycle, interpolation time and the rhythm of the process data disagree",
                         .needs =
                             "two of: SYNC0 cycle (0x09A0), object 60C2h, the drive's own cycle (--parameter), at "
                             "least 50 cycles of process data in OP",
                         .source = "ESC-1, distributed clocks; AKD-2011, 4.8; MKD, 4.9; PILZ, 4.6",
                         .doc = R"(
## What it checks
That the SYNC0 cycle (0x09A0), the interpolation time that the master wrote (60C2h) and the distance of the process
data in OP are the same time; and the drive's own cycle where it was given: FBUS.SAMPLEPERIOD (AKD, MKD), PTBASE
(Pilz).

## Why it matters
The drive interpolates its setpoints over 60C2h and executes them with SYNC0. If frames come in another rhythm it
repeats setpoints or skips them: the axis is jerky, follows with a wrong velocity or loses synchronisation.

## How it is decided
SYNC0 cycle and 60C2h are compared exactly when OP is requested, and again where one of them was written in OP, for
families that take the cycle from 60C2h. The process data are the mean over the cycles in OP, by the DC time in the
frames or by good stamps; it disagrees when it is more than a tenth off. A new mean begins when the slave leaves OP or
SYNC0 is switched off, and where the frames come to another rhythm. SAMPLEPERIOD and PTBASE are no objects:
--parameter tells them. Where the process data keep to one of two settings that disagree, the other one is what is
wrong, and caused_by names the finding that says so. For devices whose family is not known to need one frame a cycle,
SYNC0 may be a multiple of the frame cycle or a part of it.

## Example
tests/rules/sync-cycle-mismatch/violates.trace

## What to do
Set one cycle time in the master's configuration, and let it write 0x09A0 and 60C2h from it.
)"};

class SyncCycleMismatch final : public Rule {
 public:
  SyncCycleMismatch() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&SyncCycleMismatch::On);
    Subscribe<sync::SlaveRunEnded>(&SyncCycleMismatch::On);
    Subscribe<sync::RateEnded>(&SyncCycleMismatch::On);
    Subscribe<mailbox::SdoTransfer>(&SyncCycleMismatch::On);
  }

  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
      CompareChanged(e.slave);
      return;
    }
    Compare(e.slave, SettingsOf(e.slave), e.request.frame, "When OP is requested in frame ");
  }

  /// Units and exponent of the interpolation time are written one after the other: what they say is looked at later.
  void On(const mailbox::SdoTransfer& t) {
    const bool changes = t.has_object && t.index == kInterpolationTime && t.service == mailbox::SdoService::kDownload &&
                         t.outcome == mailbox::SdoOutcome::kCompleted;
    if (!changes || !context().slave(t.slave).al.SettledIn(esc::AlState::OP)) return;
    changed_in_op_[t.slave] = t.last;
  }

  void On(const sync::SlaveRunEnded& e) { CompareChanged(e.slave); }

  void On(const sync::RateEnded& e) {
    if (context().sync().outputs(e.slave).rate.cycles() < kEnoughCycles) return;
    judged_.insert(e.slave);
    Observed(e.slave);
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      CompareChanged(id);
      if (context().sync().outputs(id).rate.cycles() >= kEnoughCycles || !judged_.contains(id)) Observed(id);
    }
  }

 private:
  /// One of the places where the cycle is set, as it stands.
  struct Setting {
    std::uint64_t key = 0;
    std::string name, where, evidence;
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
      settings.push_back({1, "SYNC0 cycle", "SYNC0 cycle (0x09A0)", "sync0_cycle_ns", *active->sync0_cycle_ns,
                          active->frame.number, family.cycle_base.source});
    }
    const auto interpolation = model::InterpolationTime(slave);
    if (interpolation && family.cycle_by_60c2.value.value_or(false)) {
      settings.push_back({0, "60C2h", "interpolation time (60C2h)", "interpolation_ns", *interpolation,
                          slave.objects.Find(kInterpolationTime, 1)->since, family.cycle_by_60c2.source});
    }
    if (const auto drive = DriveCycle(slave)) {
      settings.push_back({2, family.cycle_count->keyword, family.cycle_count->keyword + ", as given,", "drive_cycle_ns",
                          *drive, 0, family.cycle_count->source});
    }
    return settings;
  }

  void Compare(SlaveId slave, const std::vector<Setting>& settings, const FrameRef& frame, const std::string& when) {
    for (std::size_t i = 1; i < settings.size(); ++i) {
      if (settings[i].time != settings[0].time) ReportSettings(slave, settings[0], settings[i], frame, when);
    }
  }

  /// What was changed while the slave was in OP.
  void CompareChanged(SlaveId slave) {
    if (const auto changed = changed_in_op_.find(slave); changed != changed_in_op_.end()) {
      Compare(slave, SettingsOf(slave), changed->second, "Since the change in OP in frame ");
      changed_in_op_.erase(changed);
    }
    const sync::DcUnit& unit = context().sync().dc(slave);
    const auto now = context().network().state(slave).registers.Value<std::uint32_t>(esc::kSync0Cycle);
    const auto& active = unit.active();
    if (!active || !active->activation.sync0() || !unit.cycle_rewritten().seen() || !now) return;
    if (*now == active->sync0_cycle_ns.value_or(*now) || !context().slave(slave).al.operated()) return;
    const std::string& source = context().slave(slave).profile->sync.cycle_base.source;
    ReportSettings(slave,
                   {1, "The SYNC0 cycle as it was switched on", "SYNC0 cycle with which SYNC was switched on",
                    "sync0_cycle_ns", *active->sync0_cycle_ns, active->frame.number, source},
                   {4, "0x09A0", "register 0x09A0 as written there", "sync0_cycle_now_ns", *now, 0, source},
                   unit.cycle_rewritten(), "In frame ");
  }

  void ReportSettings(SlaveId slave, const Setting& one, const Setting& other, const FrameRef& frame,
                      const std::string& when) {
    if (Repeat(slave, other.key, frame) != kNoFinding) return;
    Finding finding;
    finding.slave = slave;
    finding.first = frame;
    if (one.since != 0) AddRelated(finding, one.since);
    if (other.since != 0) AddRelated(finding, other.since);
    finding.reference = ReferenceTo(other.source);
    finding.title = one.name + " is " + Duration(one.time) + ", but " + other.name + " says " + Duration(other.time);
    finding.message = when + std::to_string(frame.number) + " the " + one.where + " is " + std::to_string(one.time) +
                      " ns, while the " + other.where + " is " + std::to_string(other.time) +
                      " ns. Set the same time in both.";
    finding.evidence = {Number(one.evidence, one.time), Number(other.evidence, other.time)};
    const FindingIndex index = Report(other.key, std::move(finding));
    if (index != kNoFinding) odd_settings_[slave].push_back({one.time, other.time, index});
  }

  /// The finding that tells already that this setting is not what another one says, which the process data keep to:
  /// one wrong value is one cause.
  [[nodiscard]] FindingIndex ToldOfSetting(SlaveId slave, TimeNs configured, double observed) const {
    const auto told = odd_settings_.find(slave);
    if (told == odd_settings_.end()) return kNoFinding;
    const auto kept = [observed](TimeNs time) {
      return std::abs(observed / static_cast<double>(time) - 1) <= kTolerance;
    };
    for (const OddSetting& odd : told->second) {
      if ((odd.one == configured && kept(odd.other)) || (odd.other == configured && kept(odd.one))) return odd.index;
    }
    return kNoFinding;
  }

  void Observed(SlaveId id) {
    const model::SlaveModel& slave = context().slave(id);
    // Of a run that ended without a judgement the settings still say that there was something to judge.
    const sync::DcUnit& unit = context().sync().dc(id);
    const bool ended = context().sync().outputs(id).rate.cycles() == 0;
    const auto& settings = ended ? unit.told() : unit.last_active();
    const auto interpolation = model::InterpolationTime(slave);
    const auto drive = DriveCycle(slave);
    TimeNs configured = 0;
    std::string what = "SYNC0 cycle (0x09A0)";
    if (settings && settings->activation.sync0() && settings->sync0_cycle_ns.value_or(0) > 0) {
      configured = *settings->sync0_cycle_ns;
    } else if (interpolation && slave.profile->sync.cycle_by_60c2.value.value_or(false)) {
      configured = *interpolation;
      what = "interpolation time (60C2h)";
    } else if (drive) {
      configured = *drive;
      what = slave.profile->sync.cycle_count->keyword;
    }
    if (configured == 0) return;
    const sync::OutputWatch& outputs = context().sync().outputs(id);
    if (outputs.rate.cycles() < kEnoughCycles) {
      NotEvaluable(id, "fewer than 50 cycles of process data in OP to compare the configured cycle with");
      return;
    }
    if (!context().sync().Uncertainty(outputs.rate.base())) {
      NotEvaluable(id, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming);
      return;
    }
    const auto mean = outputs.rate.mean_ns();
    const double ratio = mean / static_cast<double>(configured);
    const bool one_each = !slave.profile->sync.source_with_dc.empty();
    const double nearest = one_each ? 1.0 : ratio >= 1 ? std::round(ratio) : 1.0 / std::round(1.0 / ratio);
    const double off = std::abs(ratio / nearest - 1);
    if (off <= kTolerance) return;
    if (off - outputs.rate.JitterShare() <= kTolerance) {
      NotEvaluable(id, "the process data come too irregularly to tell their cycle");
      return;
    }
    const bus::PairingStatistics& pairing = context().pairing();
    if (pairing.gaps > 0 && outputs.rate.last().number > pairing.first_gap.number) {
      NotEvaluable(id, "the capture misses frames, in which another cycle may have been set", pairing.first_gap.number);
      return;
    }
    if (Repeat(id, 3, outputs.rate.first()) != kNoFinding) return;
    Finding finding;
    finding.slave = id;
    finding.first = outputs.rate.first();
    finding.last = outputs.rate.last();
    finding.caused_by = ToldOfSetting(id, configured, mean);
    if (settings) AddRelated(finding, settings->frame.number);
    const std::string cycle = Duration(static_cast<std::int64_t>(mean));
    finding.title = "Process data come every " + cycle + ", but the cycle is configured as " + Duration(configured);
    finding.message =
        "In OP the outputs of this slave come every " + cycle + " in the mean of " + Grouped(outputs.rate.cycles()) +
        " cycles, " + std::string(BaseText(outputs.rate.base())) + "; the " + what + " is " +
        std::to_string(configured) + " ns" +
        (one_each ? ", and the drive expects one frame in each cycle." : ", neither a multiple nor a part.") +
        " Let the master run with the configured cycle, or configure the one it runs with.";
    finding.evidence = {Real("observed_us", mean / 1e3), Real("configured_us", static_cast<double>(configured) / 1e3),
                        Text("time_base", std::string(sync::Name(outputs.rate.base())))};
    Report(3, std::move(finding));
  }

  /// Two settings that a finding compares.
  struct OddSetting {
    TimeNs one = 0, other = 0;
    FindingIndex index = kNoFinding;
  };

  std::map<SlaveId, FrameRef> changed_in_op_;
  std::map<SlaveId, std::vector<OddSetting>> odd_settings_;
  std::set<SlaveId> judged_;  // in a run that has ended
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncCycleMismatch>};

}  // namespace
}  // namespace ecaudit::sync_cycle_mismatch
