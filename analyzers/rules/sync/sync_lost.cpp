#include <optional>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_lost {
namespace {

constexpr std::uint16_t kWatchdogCode = 0x001B;
/// A master that stops takes less until it asks for another state.
constexpr TimeNs kCertainPause = 100'000'000;
constexpr const char* kMayBeHole =
    "process data stop where nobody sent anything: the master was silent, or the capture has a hole there";

constexpr RuleInfo kInfo{
    .id = "sync-lost",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .of_family = true,
    .subject = Subject::kTiming,
    .title = "By its manual the drive must have lost synchronisation",
    .needs =
        "AL state OP, FMMUs, a clock; for families that count missing frames: the status word, to know that the "
        "drive is enabled",
    .source = "AKD-2011, 4.13; AKD-2010, 4.13; MKD, 3.4; PILZ, 4.8",
    .doc = R"(
## What it checks
The families' own criteria: AKD and MKD fault with F125 when more than seven frames with process data are missing
while the drive is enabled. Pilz drives fault with F28 (or warn with n17) at the second consecutive cycle outside the
permitted jitter, or without process data.

## Why it matters
The drive stops the axis. The capture shows what the drive saw before it did.

## How it is decided
Missing frames are those of a pause in OP: its length over the cycle (SYNC0, else 60C2h, else the usual distance of
the frames), less one. One that never ends is judged from 100 ms on (or the watchdog that is set), until the master
requests another state or the capture ends; behind a silence that may be a hole in the capture only what comes after
counts. Frames that were sent and did not return may have arrived and do not count as missing. Enabled is the status
word 6041h in the inputs before the pause: Operation enabled; where it is not mapped nothing is judged. The AKD's
supervision can be switched off (FBUS.PARAM04): where the capture or --parameter shows it to be 0, or the limit lies
within the uncertainty of the clock, nothing is said. A drive that is still enabled after 64 or more was not without
frames: the capture has a hole there. After fewer it may have, too, where nobody sent anything and the indices of the
frames do not tell that none are missing. A slave that left OP with 0x001B in the pause fell by its watchdog: that is
told by sync-watchdog-margin. Pilz: as sync-window-violation judges each cycle.

## Example
samples/captures/sync-frames-missing.pcapng

## What to do
Find the pause in the master named here. The finding shows how many missing frames the family tolerates (AKD and MKD: 7).
)"};

class SyncLost final : public Rule {
 public:
  SyncLost() : Rule(kInfo) {
    Subscribe<track::CaptureGap>(&SyncLost::On);
    Subscribe<sync::OutputGap>(&SyncLost::On);
    Subscribe<sync::ArrivalOff>(&SyncLost::On);
    Subscribe<sync::SyncSlotMiss>(&SyncLost::On);
  }

  void On(const track::CaptureGap& e) { behind_hole_ = e.frame; }

  void On(const sync::OutputGap& told) {
    const model::SlaveModel& slave = context().slave(told.slave);
    if (!told.fed_before) return;
    const sync::OutputGap e = told.end == sync::OutputGap::End::kOutputs ? told : CertainPart(told);
    if (!slave.profile->sync.lost_after_missing.value && !slave.profile->sync.lost_after_jitter.value) return;
    if (const char* reason = WhyOpen(e, slave); reason != nullptr) {
      NotEvaluable(e.slave, reason, EndOf(e).number);
      return;
    }
    if (e.end != sync::OutputGap::End::kOutputs) JudgeOpen(e, slave);
    const auto& tolerated = slave.profile->sync.lost_after_missing;
    if (!tolerated.value) return;
    const auto supervision = model::ValueOf(slave, slave.profile->sync.supervision);
    if (supervision && supervision->value == 0) return;
    const TimeNs cycle = CycleOf(slave, e);
    if (cycle <= 0) return;
    const std::optional<TimeNs> missing = Missing(e, cycle, *tolerated);
    if (!missing) return;
    FindingIndex index = Repeat(e.slave, 0, EndOf(e));
    if (index == kNoFinding) index = Report(0, FindingOf(e, slave, cycle, *missing));
    if (e.fell.seen()) Remember(e, index);
  }

  void Finish() override {
    for (const Fall& fall : falls_) NameCause(context(), "al-unexpected-change", fall.slave, fall.frame, fall.cause);
  }

  void On(const sync::ArrivalOff& e) {
    const device::SyncDescription& family = context().slave(e.slave).profile->sync;
    const device::JitterLimit* limit = sync::LimitFor(context().slave(e.slave), e.cycle_ns);
    if (!family.lost_after_jitter.value || limit == nullptr || limit->undocumented || !e.uncertainty_ns) return;
    const std::uint64_t missing = e.missing > e.unreturned ? e.missing - e.unreturned : 0;
    const TimeNs size = e.deviation_ns < 0 ? -e.deviation_ns : e.deviation_ns;
    const bool off = size - *e.uncertainty_ns > limit->jitter;
    Run& run = RunOf(e.slave);
    if (missing == 0 && !off) return;
    if (missing > 0) Extend(run, e.cycle - missing, e.cycle - 1, e.before);
    if (off) Extend(run, e.cycle, e.cycle, e.before);
    Judge(e.slave, run, e.frame);
  }

  void On(const sync::SyncSlotMiss& e) {
    const device::SyncDescription& family = context().slave(e.slave).profile->sync;
    // Frames that crept over a pulse leave one interval empty, and nobody knows which.
    if (!family.lost_after_jitter.value || e.crept > 0 || e.empty <= e.unreturned) return;
    if (IsHole(context().sync().outputs(e.slave), e.empty)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kPauseOfDrive, e.frame.number);
      return;
    }
    Run run{e.empty - e.unreturned, 0, e.before};
    Judge(e.slave, run, e.frame);
  }

 private:
  static const FrameRef& EndOf(const sync::OutputGap& e) { return e.after.seen() ? e.after : e.fell; }

  /// Of a pause that does not end: what lies behind a silence of the master that may be a hole in the capture. The
  /// frames that come since then show that it goes on, and bring no process data.
  [[nodiscard]] sync::OutputGap CertainPart(const sync::OutputGap& told) const {
    sync::OutputGap e = told;
    const FrameRef& end = EndOf(e);
    const bool doubtful = context().sync().outputs(e.slave).may_be_hole && behind_hole_.number > e.before.number;
    if (!doubtful || !behind_hole_.has_time || !end.has_time) return e;
    e.before = behind_hole_;
    e.gap = {Elapsed(behind_hole_.time, end.time), sync::TimeBase::kCapture};
    e.uncertainty_ns = context().sync().Uncertainty(sync::TimeBase::kCapture);
    return e;
  }

  /// Why a pause that does not end cannot be judged; null where it can, or ends.
  [[nodiscard]] const char* WhyOpen(const sync::OutputGap& e, const model::SlaveModel& slave) const {
    if (e.end == sync::OutputGap::End::kOutputs || e.fell.seen()) return nullptr;
    const bool asked = e.end == sync::OutputGap::End::kRequest;
    const bool in_op = asked ? slave.al.possible().contains(static_cast<std::uint8_t>(esc::AlState::OP))
                             : slave.al.SettledIn(esc::AlState::OP);
    if (!in_op) return "process data stop, and whether the slave is in OP still is not known";
    const bool doubtful = context().sync().outputs(e.slave).may_be_hole && e.gap.ns < kCertainPause;
    return doubtful ? kMayBeHole : nullptr;
  }

  /// Where process data never come again no arrival tells of the cycles without them.
  void JudgeOpen(const sync::OutputGap& e, const model::SlaveModel& slave) {
    if (!slave.profile->sync.lost_after_jitter.value) return;
    const TimeNs cycle = CycleOf(slave, e);
    if (cycle <= 0 || (e.fell.seen() && (!e.fell_code || *e.fell_code == kWatchdogCode))) return;
    if (!e.uncertainty_ns) {
      NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, EndOf(e).number);
      return;
    }
    const TimeNs missing = (e.gap.ns - *e.uncertainty_ns) / cycle - 1 - static_cast<TimeNs>(e.unreturned);
    if (missing > 0) Judge(e.slave, {static_cast<std::uint64_t>(missing), 0, e.before}, EndOf(e));
  }

  [[nodiscard]] TimeNs CycleOf(const model::SlaveModel& slave, const sync::OutputGap& e) const {
    const auto& settings = context().sync().dc(e.slave).active();
    if (settings && settings->activation.sync0() && settings->sync0_cycle_ns.value_or(0) > 0) {
      return *settings->sync0_cycle_ns;
    }
    const auto interpolation = model::InterpolationTime(slave);
    return interpolation ? *interpolation : e.nominal_ns;
  }

  /// Frames that are certainly missing, where they are more than the drive tolerates and nothing else explains it.
  /// Where that is open, it is said.
  std::optional<TimeNs> Missing(const sync::OutputGap& e, TimeNs cycle, TimeNs limit) {
    // The frame after the pause is not missing, and neither are those that may have arrived.
    const auto missing_at = [&](TimeNs gap) {
      return (gap + cycle / 2) / cycle - 1 - static_cast<TimeNs>(e.unreturned);
    };
    if (!e.uncertainty_ns) {
      if (missing_at(e.gap.ns) > limit)
        NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, EndOf(e).number);
      return std::nullopt;
    }
    const TimeNs least = missing_at(e.gap.ns - *e.uncertainty_ns);
    if (least <= limit) {
      if (least + static_cast<TimeNs>(e.unreturned) > limit && OperationEnabled(e.status_word)) {
        NotEvaluable(e.slave, "frames were sent in the pause whose fate is not in the capture", EndOf(e).number);
      }
      if (missing_at(e.gap.ns + *e.uncertainty_ns) > limit) {
        NotEvaluable(e.slave,
                     "whether more than " + Count(static_cast<std::uint64_t>(limit), "frame") +
                         " are missing lies within the clock's uncertainty",
                     EndOf(e).number);
      }
      return std::nullopt;
    }
    // The watchdog was faster, and the drive says so: sync-watchdog-margin tells of the pause.
    if (e.fell.seen() && (!e.fell_code || *e.fell_code == kWatchdogCode)) return std::nullopt;
    if (!e.status_word) {
      NotEvaluable(e.slave, "whether the drive was enabled is not known: the status word is not in its known inputs",
                   EndOf(e).number);
      return std::nullopt;
    }
    if (!OperationEnabled(e.status_word)) return std::nullopt;
    const bool ends = e.end == sync::OutputGap::End::kOutputs;
    if (ends && !e.fell.seen() && IsHole(context().sync().outputs(e.slave), static_cast<std::uint64_t>(least))) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kPauseOfDrive, EndOf(e).number);
      return std::nullopt;
    }
    return least;
  }

  [[nodiscard]] static Finding FindingOf(const sync::OutputGap& e, const model::SlaveModel& slave, TimeNs cycle,
                                         TimeNs missing) {
    const auto& tolerated = slave.profile->sync.lost_after_missing;
    const TimeNs limit = *tolerated;
    Finding finding;
    finding.slave = e.slave;
    finding.first = EndOf(e);
    AddRelated(finding, e.before.number);
    finding.reference = ReferenceTo(tolerated.source);
    const std::string fault =
        slave.profile->sync.lost_faults.empty() ? "loss of synchronisation" : slave.profile->sync.lost_faults.front();
    const std::string frames = Count(static_cast<std::uint64_t>(missing), "frame");
    finding.title = frames + " with process data missing: " + fault;
    finding.message = "Between frame " + std::to_string(e.before.number) + " and frame " +
                      std::to_string(EndOf(e).number) + WhereText(e.end) + " outputs paused for " + Duration(e.gap.ns) +
                      PrecisionText(e.gap, *e.uncertainty_ns) + ": " + frames + " of the cycle of " + Duration(cycle) +
                      " are missing. " + LawText(*slave.profile) + " lets the drive fault (" + fault +
                      ") when more than " + std::to_string(limit) +
                      " are missing while it is enabled, which the status word " + Hex(*e.status_word) +
                      " says it was. Find out why the master paused.";
    finding.evidence = {Number("missing_frames", missing), Number("tolerated_frames", limit),
                        Real("gap_ms", static_cast<double>(e.gap.ns) / 1e6),
                        Text("time_base", std::string(sync::Name(e.gap.base))),
                        HexNumber("status_word", *e.status_word)};
    return finding;
  }

  static std::string WhereText(sync::OutputGap::End end) {
    if (end == sync::OutputGap::End::kCapture) return ", where the capture ends,";
    if (end == sync::OutputGap::End::kRequest) return ", where the master requests another state,";
    return "";
  }

  /// Consecutive cycles outside the window.
  struct Run {
    std::uint64_t length = 0;
    std::uint64_t last = 0;  ///< the last of them
    FrameRef before;
  };

  struct Fall {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  void Remember(const sync::OutputGap& e, FindingIndex cause) {
    constexpr std::size_t kMost = 256;
    if (falls_.size() < kMost) falls_.push_back({e.slave, e.fell.number, cause});
  }
  Run& RunOf(SlaveId slave) {
    if (slave >= runs_.size()) runs_.resize(static_cast<std::size_t>(slave) + 1);
    return runs_[slave];
  }
  static void Extend(Run& run, std::uint64_t first, std::uint64_t last, const FrameRef& before) {
    if (run.length == 0 || run.last + 1 != first) run = {0, 0, before};
    run.length += last - first + 1;
    run.last = last;
  }

  void Judge(SlaveId id, const Run& run, const FrameRef& frame) {
    const device::DeviceDescription& profile = *context().slave(id).profile;
    const auto& limit = profile.sync.lost_after_jitter;
    if (run.length < *limit || Repeat(id, 1, frame) != kNoFinding) return;
    Finding finding;
    finding.slave = id;
    finding.first = frame;
    AddRelated(finding, run.before.number);
    finding.reference = ReferenceTo(limit.source);
    std::string names;
    for (const std::string& fault : profile.sync.lost_faults) names += (names.empty() ? "" : ", ") + fault;
    for (const std::string& warning : profile.sync.lost_warnings) names += (names.empty() ? "" : ", ") + warning;
    finding.title = Count(run.length, "consecutive cycle") +
                    " outside the window: " + (names.empty() ? "synchronisation lost" : names);
    finding.message = "From frame " + std::to_string(run.before.number) + " to frame " + std::to_string(frame.number) +
                      " " + Count(run.length, "consecutive cycle") +
                      " had no process data within the permitted jitter. " + LawText(profile) +
                      " lets the drive lose "
                      "synchronisation (" +
                      names + ") at the " + (*limit == 2 ? "second" : Ordinal(*limit)) +
                      ". Find out why the master was late.";
    finding.evidence = {Number("consecutive", static_cast<std::int64_t>(run.length)), Number("limit", *limit)};
    Report(1, std::move(finding));
  }

  FrameRef behind_hole_;  ///< the last frame before which the capture may have one
  std::vector<Run> runs_;
  std::vector<Fall> falls_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncLost>};

}  // namespace
}  // namespace ecaudit::sync_lost
