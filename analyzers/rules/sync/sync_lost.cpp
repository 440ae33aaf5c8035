#include <bit>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_lost {
namespace {

/// A master that stops requests another state sooner.
constexpr TimeNs kCertainPause = 100'000'000;

constexpr Word kMissingFrames{"missing-frames", "the number of missing frames"};

constexpr FindingKind kFramesMissing{
    .name = "frames-missing",
    .title = "{missing_frames} with process data missing, {tolerated_frames} tolerated[: {fault}]",
    .message =
        R"(From {before_frame} to {frame} outputs paused for {gap_ms} (+-{uncertainty_us} by {time_base}).[ In {frame}
{pause_end}.] So {missing_frames} of the cycle of {cycle_us} {missing_frames?is|are} missing. [The manual
({manual})][{!manual}The EtherCAT standard] lets the drive lose synchronisation[ ({fault})] when more than
{tolerated_frames} are missing while it is enabled. The status word {status_word} ({state}) shows that it was
enabled.)",
    .next = "Find out why the master paused."};

constexpr FindingKind kCyclesOutside{
    .name = "cycles-outside",
    .title = "{consecutive} outside the permitted jitter[: {faults}]",
    .message = R"({consecutive} had no process data within the permitted jitter: from {before_frame} to {frame}. [The
manual ({manual})][{!manual}The EtherCAT standard] lets the drive lose synchronisation[ ({faults})] after {limit} such
{limit?cycle|cycles} in a row.)",
    .next = "Find out why the master was late or paused."};

constexpr NoteKind kMayBeOff{
    .name = "supervision-may-be-off",
    .text =
        "{parameter} can switch this supervision off[ ({bit_count?bit|bits} {off_bits})], and its value is not in the "
        "capture ({source}). If the drive stays enabled without a fault, the supervision may be off. Give the value "
        "with --parameter {parameter}=N."};

constexpr const FindingKind* kKinds[] = {&kFramesMissing, &kCyclesOutside};
constexpr const NoteKind* kNotes[] = {&kMayBeOff};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sm-changed-while-active"};

constexpr RuleInfo kInfo{
    .id = "sync-lost",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .history = History::kWhole,
    .of_family = true,
    .subject = Subject::kTiming,
    .title = "By its manual the drive must have lost synchronisation",
    .needs =
        "AL state OP, FMMUs, a clock; for families that count missing frames: the status word, which shows that the "
        "drive is enabled",
    .source = "AKD-2011, 4.13; AKD-2010, 4.13; MKD, 3.4; PILZ, 4.8",
    .kinds = kKinds,
    .notes = kNotes,
    .after = kAfter,
    .doc = R"(
## What it checks
The criteria of the families:

- AKD and MKD fault with F125 when more frames with process data are missing than they tolerate (7), while the drive is
  enabled.
- Pilz drives fault with F28, or warn with n17, at the second consecutive cycle without process data or outside the
  permitted jitter.

## Why it matters
The drive stops the axis. The capture shows what the drive received before that.

## How it is decided
- Missing frames are those of a pause in OP: its length divided by the cycle, less one. The cycle is that of SYNC0, else
  60C2h, else the usual distance of the frames.
- A pause that never ends is evaluated from 100 ms on (or from the watchdog that is set). It counts until the master
  requests another state or the capture ends. If its begin may be a capture gap, only the time after that counts.
- Frames that never returned may have reached the drive. They do not count as missing.
- Enabled means: the status word 6041h in the inputs before the pause shows a state in which the power stage is enabled.
  These are Operation enabled, Quick stop active and, by the manuals, Switched on. If it is not mapped, nothing is
  evaluated.
- The supervision can be switched off: AKD by FBUS.PARAM04 = 0, Pilz by SERCSET bits 17 and 18. If the capture or
  --parameter shows that, nothing is reported. If the value is unknown, a note names the parameter.
- If the limit lies within the uncertainty of the clock, nothing is reported.
- If the drive is still enabled after 64 missing frames or more, the capture has a gap. With fewer it may have one if no
  frame at all was captured in the pause, and the indices of the frames do not show that none are missing.
- If the slave left OP with 0x001B in the pause, its watchdog expired. sync-watchdog-margin reports that.
- Pilz: each cycle is evaluated as by sync-window-violation. A frame that is late by more than half a cycle counts as
  one cycle outside, not as two.

## Example
samples/captures/sync-frames-missing.pcapng

## What to do
Find the pause in the master. The finding shows how many missing frames the family tolerates (AKD and MKD: 7).
)"};

class SyncLost final : public Rule {
 public:
  SyncLost() : Rule(kInfo) {
    Subscribe<track::CaptureGap>(&SyncLost::On);
    Subscribe<sync::OutputGap>(&SyncLost::On);
    Subscribe<sync::ArrivalOff>(&SyncLost::On);
    Subscribe<sync::SyncSlotMiss>(&SyncLost::On);
  }

  void On(const track::CaptureGap& e) { after_gap_ = e.frame; }

  void On(const sync::OutputGap& whole) {
    const model::SlaveModel& slave = context().slave(whole.slave);
    if (!whole.fed_before) return;
    const sync::OutputGap e = whole.end == sync::OutputGap::End::kOutputs ? whole : CertainPart(whole);
    if (!slave.profile->sync.lost_after_missing.value && !slave.profile->sync.lost_after_jitter.value) return;
    if (const std::optional<Reason> reason = WhyOpen(e, slave)) return NotEvaluable(e.slave, *reason, EndOf(e).number);
    if (e.end != sync::OutputGap::End::kOutputs) EvaluateOpen(e, slave);
    const auto& tolerated = slave.profile->sync.lost_after_missing;
    if (!tolerated.value) return;
    const auto supervision = model::ValueOf(slave, slave.profile->sync.supervision);
    if (supervision && !slave.profile->sync.supervision->IsOn(supervision->value)) return;
    const TimeNs cycle = CycleOf(slave, e);
    if (cycle <= 0) return;
    const std::optional<TimeNs> missing = Missing(e, cycle, *tolerated);
    if (!missing) return;
    FindingIndex index = Repeat(e.slave, 0, EndOf(e));
    if (index == kNoFinding) index = Report(0, FindingOf(e, slave, cycle, *missing));
    if (e.fell.seen()) Remember(e, index);
  }

  void Finish() override {
    for (const LeftOp& left : left_op_)
      NameCause(context(), "al-unexpected-change", left.slave, left.frame, left.cause);
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
    // Early for its cycle, after one without a frame: a frame of that one, late. The next frame may be in time.
    if (off && (missing == 0 || e.deviation_ns > 0)) Extend(run, e.cycle, e.cycle, e.before);
    Evaluate(e.slave, run, e.frame);
  }

  void On(const sync::SyncSlotMiss& e) {
    const device::SyncDescription& family = context().slave(e.slave).profile->sync;
    // Frames that drifted across a pulse leave one interval empty, but it is not known which.
    if (!family.lost_after_jitter.value || e.crept > 0 || e.empty <= e.unreturned) return;
    if (IsHole(context().sync().outputs(e.slave), e.empty)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kPauseOfDrive, e.frame.number);
      return;
    }
    Run run{e.empty - e.unreturned, 0, e.before};
    Evaluate(e.slave, run, e.frame);
  }

 private:
  static const FrameRef& EndOf(const sync::OutputGap& e) { return e.after.seen() ? e.after : e.fell; }

  /// Of a pause that does not end: what comes after a possible capture gap. The frames since then show that the pause
  /// goes on, and bring no process data.
  [[nodiscard]] sync::OutputGap CertainPart(const sync::OutputGap& whole) const {
    sync::OutputGap e = whole;
    const FrameRef& end = EndOf(e);
    const bool doubtful = context().sync().outputs(e.slave).may_be_hole && after_gap_.number > e.before.number;
    if (!doubtful || !after_gap_.has_time || !end.has_time) return e;
    e.before = after_gap_;
    e.gap = {Elapsed(after_gap_.time, end.time), sync::TimeBase::kCapture};
    e.uncertainty_ns = context().sync().Uncertainty(sync::TimeBase::kCapture);
    return e;
  }

  /// Why a pause that does not end cannot be evaluated; nothing if it can, or ends.
  [[nodiscard]] std::optional<Reason> WhyOpen(const sync::OutputGap& e, const model::SlaveModel& slave) const {
    if (e.end == sync::OutputGap::End::kOutputs || e.fell.seen()) return std::nullopt;
    const bool asked = e.end == sync::OutputGap::End::kRequest;
    const bool in_op = asked ? slave.al.possible().contains(static_cast<std::uint8_t>(esc::AlState::OP))
                             : slave.al.SettledIn(esc::AlState::OP);
    if (!in_op) return Reason::Of(ReasonCode::kNotInCapture, what::kAlState);
    if (context().statistics().last_cut.number > e.before.number) return Reason::Of(ReasonCode::kSnapLength);
    const bool doubtful = context().sync().outputs(e.slave).may_be_hole && e.gap.ns < kCertainPause;
    // The master paused, or the capture has a gap.
    return doubtful ? std::optional(Reason::Of(ReasonCode::kAmbiguous, what::kPause)) : std::nullopt;
  }

  /// If process data never come again, no arrival shows the cycles without them.
  void EvaluateOpen(const sync::OutputGap& e, const model::SlaveModel& slave) {
    if (!slave.profile->sync.lost_after_jitter.value) return;
    const TimeNs cycle = CycleOf(slave, e);
    if (cycle <= 0 || (e.fell.seen() && (!e.fell_code || *e.fell_code == esc::al_code::kWatchdog))) return;
    if (!e.uncertainty_ns) {
      NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, EndOf(e).number);
      return;
    }
    const TimeNs missing = (e.gap.ns - *e.uncertainty_ns) / cycle - 1 - static_cast<TimeNs>(e.unreturned);
    if (missing > 0) Evaluate(e.slave, {static_cast<std::uint64_t>(missing), 0, e.before}, EndOf(e));
  }

  [[nodiscard]] TimeNs CycleOf(const model::SlaveModel& slave, const sync::OutputGap& e) const {
    const auto& settings = context().sync().dc(e.slave).active();
    if (settings && settings->activation.sync0() && settings->sync0_cycle_ns.value_or(0) > 0) {
      return *settings->sync0_cycle_ns;
    }
    const auto interpolation = model::InterpolationTime(slave);
    return interpolation ? *interpolation : e.nominal_ns;
  }

  /// Frames that are certainly missing, if they are more than the drive tolerates and nothing else explains it. If that
  /// is open, the reason is added.
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
      if (least + static_cast<TimeNs>(e.unreturned) > limit && IsEnabled(e)) {
        NotEvaluable(e.slave, ReasonCode::kNeverReturned, what::kWorkingDuringPause, EndOf(e).number);
      }
      if (missing_at(e.gap.ns + *e.uncertainty_ns) > limit) {
        NotEvaluable(e.slave, ReasonCode::kWithinUncertainty, kMissingFrames, EndOf(e).number);
      }
      return std::nullopt;
    }
    // The watchdog was faster, as the drive reports: sync-watchdog-margin reports the pause.
    if (e.fell.seen() && (!e.fell_code || *e.fell_code == esc::al_code::kWatchdog)) return std::nullopt;
    if (!e.status_word) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kStatusWord, EndOf(e).number);
      return std::nullopt;
    }
    if (!IsEnabled(e)) return std::nullopt;
    const bool ends = e.end == sync::OutputGap::End::kOutputs;
    if (ends && !e.fell.seen() && StaysEnabled(e, static_cast<std::uint64_t>(least))) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kPauseOfDrive, EndOf(e).number);
      return std::nullopt;
    }
    return least;
  }

  [[nodiscard]] bool ShowsEnabled(SlaveId slave, const std::optional<std::uint16_t>& word) const {
    const auto& drive = context().slave(slave).profile->drive;
    return word && drive && drive->ShowsEnabled(*word);
  }
  [[nodiscard]] bool IsEnabled(const sync::OutputGap& e) const { return ShowsEnabled(e.slave, e.status_word); }
  /// As IsHole(), for all states in which the power stage is enabled.
  [[nodiscard]] bool StaysEnabled(const sync::OutputGap& e, std::uint64_t cycles) const {
    const sync::OutputWatch& outputs = context().sync().outputs(e.slave);
    return (cycles >= kHoleCycles || outputs.may_be_hole) && ShowsEnabled(e.slave, outputs.last_status_word) &&
           ShowsEnabled(e.slave, outputs.status_word);
  }

  [[nodiscard]] static Finding FindingOf(const sync::OutputGap& e, const model::SlaveModel& slave, TimeNs cycle,
                                         TimeNs missing) {
    const auto& tolerated = slave.profile->sync.lost_after_missing;
    Finding finding = Found(kFramesMissing, e.slave, EndOf(e));
    AddRelated(finding, e.before.number);
    finding.reference = ReferenceTo(tolerated.source);
    finding.Set("missing_frames", arg::Count(static_cast<std::uint64_t>(missing), "frame"))
        .Set("tolerated_frames", arg::Number(*tolerated))
        .Set("gap_ms", arg::Ms(e.gap.ns))
        .Set("uncertainty_us", arg::Us(*e.uncertainty_ns))
        .Set("time_base", arg::Of(WordOf(e.gap.base)))
        .Set("cycle_us", arg::Us(cycle))
        .Set("status_word", arg::Hex(*e.status_word))
        .Set("before_frame", arg::Frame(e.before.number));
    const bool left_op = e.end == sync::OutputGap::End::kFell;
    if (const Word* end = WordOf(e.end); end != nullptr && !left_op) finding.Set("pause_end", arg::Of(*end));
    const std::vector<std::string>& faults = slave.profile->sync.lost_faults;
    if (!faults.empty()) finding.Set("fault", arg::Text(faults.front()));
    if (slave.profile->drive) finding.Set("state", StateValue(slave.profile->drive->StateOf(*e.status_word)));
    SetManual(finding, *slave.profile);
    return finding;
  }

  /// Consecutive cycles outside the window.
  struct Run {
    std::uint64_t length = 0;
    std::uint64_t last = 0;  ///< the last of them
    FrameRef before;
  };

  struct LeftOp {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  void Remember(const sync::OutputGap& e, FindingIndex cause) {
    constexpr std::size_t kMost = 256;
    if (left_op_.size() < kMost) left_op_.push_back({e.slave, e.fell.number, cause});
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

  void Evaluate(SlaveId id, const Run& run, const FrameRef& frame) {
    const device::DeviceDescription& profile = *context().slave(id).profile;
    const auto& limit = profile.sync.lost_after_jitter;
    const std::optional<device::DriveParameter>& parameter = profile.sync.supervision;
    const auto supervision = model::ValueOf(context().slave(id), parameter);
    if (supervision && !parameter->IsOn(supervision->value)) return;
    if (run.length < *limit || Repeat(id, 1, frame) != kNoFinding) return;
    Finding finding = Found(kCyclesOutside, id, frame);
    AddRelated(finding, run.before.number);
    finding.reference = ReferenceTo(limit.source);
    finding.Set("consecutive", arg::Count(run.length, "consecutive cycle"))
        .Set("limit", arg::Number(*limit))
        .Set("before_frame", arg::Frame(run.before.number));
    std::vector<Value> faults;
    for (const std::string& fault : profile.sync.lost_faults) faults.push_back(arg::Text(fault));
    for (const std::string& warning : profile.sync.lost_warnings) faults.push_back(arg::Text(warning));
    if (!faults.empty()) finding.Set("faults", arg::List(std::move(faults)));
    SetManual(finding, profile);
    if (parameter && !supervision && parameter->off_bits != 0) {
      finding.Add(kMayBeOff, {{"parameter", arg::Text(parameter->keyword)},
                              {"off_bits", arg::Bits(parameter->off_bits)},
                              {"bit_count", arg::Number(std::popcount(parameter->off_bits))},
                              {"source", arg::Text(parameter->source)}});
    }
    Report(1, std::move(finding));
  }

  FrameRef after_gap_;  ///< the last frame before which the capture may have a gap
  std::vector<Run> runs_;
  std::vector<LeftOp> left_op_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncLost>};

}  // namespace
}  // namespace ecaudit::sync_lost
