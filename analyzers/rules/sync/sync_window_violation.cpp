#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
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
#include "decoder/base/time.h"

namespace ecaudit::sync_window_violation {
namespace {

/// The rhythm of the frames is not that of SYNC0 (sync-cycle-mismatch) if it is off by more than this part.
constexpr double kOtherRhythm = 0.1;
/// Frames are as far apart as their intervals within this part of a cycle.
constexpr double kInPlace = 0.125;

/// Of a slave that may not need one frame in each interval: from this number of misses on, if they are this share of
/// the intervals, and if those without a frame and those with two differ by at most this share of the misses.
constexpr std::uint64_t kManyMissed = 20;
constexpr std::uint64_t kMissedOneIn = 100;
constexpr std::uint64_t kUnbalancedOneIn = 4;

constexpr Word kSyncSource{"sync-source", "the way in which the drive synchronises to SYNC0"};
constexpr Word kDrift{"drift-across-sync0", "the drift of the frames across SYNC0"};
constexpr Word kJitter{"jitter", "the jitter of the process data"};
constexpr Word kPllDistance{"pll-distance", "the expected delay of the PLL (or its --parameter)"};
constexpr Word kPllWindow{"pll-window", "the window of the PLL (or its --parameter)"};
constexpr Word kDcTime{"dc-time-in-frames", "the DC time in the frames with process data"};
constexpr Word kNearSync0{"arrival-near-sync0", "the arrival of frames close to SYNC0"};
constexpr Word kDcTimeAndStamps{"dc-and-stamps", "the DC time in another frame of the cycle and the stamps", true};

constexpr std::string_view kSync0Next =
    R"([{?frames}Let the cycle of the master follow the DC time.][{?frame_cycle_us}Send the frames with the cycle
of SYNC0.][{?usual_phase_us}Find what delayed the master here, and check whether its cycle follows the DC
time.][{?near_sync0}Shift SYNC0 to the middle between two frames, and send more regularly.])";
constexpr std::string_view kJitterMessage =
    R"({frame} arrives [{early_us} earlier][{!early_us}{deviation_us} later] than expected from the cycles of {cycle_us} before it
(+-{uncertainty_us} by {time_base}). [The manual ({manual})][{!manual}The EtherCAT standard] permits a jitter of
{permitted_us}.[ Note of the profile: {note}.])";
constexpr std::string_view kJitterNext = "Make the sending of the master more regular.";

constexpr FindingKind kEmptyInterval{
    .name = "interval-empty",
    .title = "{empty_intervals} without process data",
    .message =
        R"(SYNC0 comes every {cycle_us}. [{frames} and {pulses} came from {before_frame} to {frame}: the frames drift
across SYNC0. So {empty_intervals} passed without outputs.][{!frames}{empty_intervals} passed without outputs between
{before_frame} and {frame}.] {frame} arrives {phase_us} after a pulse (+-{uncertainty_us} by {time_base}). The drive
needs one frame in each interval ({sync_source}).[ The frames come every {frame_cycle_us}.][ On average they arrive
{usual_phase_us} after a pulse, far from the next one.])",
    .next = kSync0Next};

constexpr FindingKind kTwoFrames{
    .name = "two-frames",
    .title = "Two frames with process data in one SYNC0 interval",
    .message =
        R"(SYNC0 comes every {cycle_us}. [{frames} and {pulses} came from {before_frame} to {frame}: the frames drift
across SYNC0, and two arrive between the same two pulses.][{!frames}Frames {before_frame:number} and {frame:number}
arrive between the same two pulses.] {frame} arrives {phase_us} after a pulse (+-{uncertainty_us} by {time_base}). The
drive needs one frame in each interval ({sync_source}).[ The frames come every {frame_cycle_us}.][ On average they
arrive {usual_phase_us} after a pulse, far from the next one.])",
    .next = kSync0Next};

constexpr FindingKind kEmptyCycle{
    .name = "cycle-empty",
    .title = "{missing_cycles} without process data",
    .message = R"({missing_cycles} passed without outputs between {before_frame} and {frame}. The cycle is {cycle_us}
(+-{uncertainty_us} by {time_base}). [The manual ({manual})][{!manual}The EtherCAT standard] permits a jitter of
{permitted_us}.[ Note of the profile: {note}.])",
    .next = kJitterNext};

constexpr FindingKind kLate{.name = "late",
                            .title = "Process data {deviation_us} late, {permitted_us} permitted",
                            .message = kJitterMessage,
                            .next = kJitterNext};

constexpr FindingKind kEarly{.name = "early",
                             .title = "Process data {early_us} early, {permitted_us} permitted",
                             .message = kJitterMessage,
                             .next = kJitterNext};

constexpr FindingKind kPllOutside{
    .name = "pll-outside",
    .title = "PLL outside its window: {sync_actual}, expected {sync_distance} +-{sync_window}",
    .message = R"(In OP with SYNC0 on the drive reports {actual_parameter} = {sync_actual} in {frame}.
{distance_parameter} is {sync_distance} ([{distance_object} in {distance_frame}][{!distance_frame}given by
--parameter]). {window_parameter} is {sync_window} ([{window_object} in {window_frame}][{!window_frame}given by
--parameter]). [The manual ({manual})][{!manual}The EtherCAT standard] requires a value strictly inside that window[
for {threshold}].)",
    .next = R"(Make the cycle of the master more regular, or check that it sends with the cycle of SYNC0.)"};

constexpr FindingKind kIrregular{
    .name = "irregular",
    .title = "{missed_share} of the SYNC0 intervals have 0 or 2 frames instead of 1",
    .message = R"(SYNC0 comes every {cycle_us}. From {frame} to {last_frame} in OP, {empty_intervals} had no frame with
process data, and {double_intervals} had two. That is {missed_share} of {intervals}.[ The longest run without a frame is
{longest_run}.][ By their stamps the frames come
{shortest_us} to {longest_us} apart: the master sends irregularly.] A slave that takes its outputs at SYNC0 repeats a set
point or misses one each time.)",
    .next = R"(Send process data at constant intervals: check real-time priority, the driver of the network card and
the load of the computer. Let the cycle of the master follow the DC time.)"};
constexpr const FindingKind* kKinds[] = {&kIrregular, &kEmptyInterval, &kTwoFrames, &kEmptyCycle,
                                         &kLate,      &kEarly,         &kPllOutside};

constexpr RuleInfo kInfo{
    .id = "sync-window-violation",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .of_family = true,
    .subject = Subject::kTiming,
    .title = "Process data arrive outside the window in which the drive expects them",
    .needs =
        "with SYNC0: DC time in the frames with process data; without: the permitted jitter of the family, good stamps",
    .source = "AKD-2011, 4.10; AKD-2010, 4.10; MKD, 4.11; PILZ, 4.8",
    .kinds = kKinds,
    .doc = R"(
## What it checks
With SYNC0, in OP:

- One frame with outputs arrives between two pulses. An interval without a frame, or with two, means that a frame came
  on the wrong side of SYNC0.
- If the master reads the measurement of the drive itself (AKD and MKD: SYNCACT, 3496h:2), it lies inside SYNCDIST +-
  SYNCWND.

Without SYNC0: outputs arrive within the jitter that the family permits (Pilz: 320 us for cycles of 1 ms and more, 70 us
up to 750 us), and none is missing.

## Why it matters
At SYNC0 the drive uses the outputs that it has. An interval without new ones repeats old setpoints, one with two
skips a setpoint: the axis jerks. Without SYNC0 a Pilz drive counts the violation. The second in a row is a loss of
synchronisation.

## How it is decided
With SYNC0:

- The arrival is the DC time that the frame itself carries, plus the propagation delay of the slave, plus the length of
  the frame.
- While a frame lies within 1 us of a pulse (or within 0x092C of the slave), it is on no side.
- Frames that drift across a pulse do so inside that range. So frames and pulses are counted from the last frame whose
  side is certain, as long as no interval is so long that a frame may be missing in it.
- If not the frames themselves but others of the cycle carry the time, a frame is certain for this count when it lies a
  quarter of the cycle away.
- A late frame leaves an interval empty and makes the next one have two. If each finding of one kind makes up for one of
  the other kind before it, caused_by names that kind.
- SYNCACT counts in OP with SYNC0 on, after PLLTHRESH cycles if that is known. SYNCDIST and SYNCWND come from SDO
  transfers or from --parameter. The AKD manuals do not print these objects: they are those of the MKD, and the finding
  is inferred.
- One interval is an error only for families that are known to synchronise this way.
- For any other slave at least 20 intervals, and 1 in 100, must have 0 or 2 frames. The numbers of both kinds must
  differ by a quarter at most, as they do when frames come late. Else the master has another cycle or a second task, and
  nothing is reported. The finding is a warning.

Without SYNC0:

- The expected arrival lies on the line through the frames so far, which it follows slowly, from the 100th cycle in OP
  on.
- The limit is that for 60C2h if the master wrote it and its cycle is about that, else for the measured cycle.
- Between 750 us and 1 ms the Pilz manual gives no figure: 70 us is applied as a warning.

Not evaluated:

- stamps that are too coarse, or a deviation that equals the limit within their uncertainty and that of the line,
- frames that never returned,
- 64 or more missing cycles of a drive that stays enabled: the capture has a gap there.

## Example
tests/rules/sync-window-violation/violates.trace

## What to do
Shift SYNC0 (start time) to the middle between two frames, and make the sending of the master more regular. The report
shows the phase of the frames against SYNC0 for each slave.
)"};

class SyncWindowViolation final : public Rule {
 public:
  SyncWindowViolation() : Rule(kInfo) {
    Subscribe<sync::SyncSlotMiss>(&SyncWindowViolation::On);
    Subscribe<sync::ArrivalOff>(&SyncWindowViolation::On);
    Subscribe<sync::PllMeasured>(&SyncWindowViolation::On);
  }

  void On(const sync::SyncSlotMiss& e) {
    const device::SyncDescription& family = context().slave(e.slave).profile->sync;
    if (e.empty > 0 && e.unreturned > 0) {
      NotEvaluable(e.slave, ReasonCode::kNeverReturned, what::kProcessFrames, e.frame.number);
      return;
    }
    if (IsHole(context().sync().outputs(e.slave), e.empty)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kPauseOfDrive, e.frame.number);
      return;
    }
    if (e.empty > 0 && MayMissBetween(e.before, e.frame)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, e.frame.number);
      return;
    }
    if (const sync::DcClock& clock = context().sync().clock();
        e.crept > 0 && clock.distributions() == 0 && e.slave != clock.reference()) {
      // By a clock that the clock of the slave need not follow.
      NotEvaluable(e.slave, ReasonCode::kAmbiguous, kDrift, e.frame.number);
      return;
    }
    if (family.source_with_dc.empty()) {
      OfAnySlave(e.slave).Add(e);
      return;
    }
    FindingIndex index = Repeat(e.slave, e.empty > 0 ? 1 : 2, e.frame);
    if (index != kNoFinding) {
      AddRelated(context().store[index], e.frame.number);
    } else {
      index = ReportMiss(e, family);
    }
    Follow(e, index);
  }

  FindingIndex ReportMiss(const sync::SyncSlotMiss& e, const device::SyncDescription& family) {
    Finding finding = Found(e.empty > 0 ? kEmptyInterval : kTwoFrames, e.slave, e.frame);
    AddRelated(finding, e.before.number);
    finding.Set("empty_intervals", arg::Count(e.empty, "SYNC0 interval"))
        .Set("phase_us", arg::Us(e.phase_ns))
        .Set("cycle_us", arg::Us(e.cycle_ns))
        .Set("uncertainty_us", arg::Us(e.uncertainty_ns))
        .Set("time_base", arg::Of(e.by_stamps ? kDcTimeAndStamps : WordOf(sync::TimeBase::kDc)))
        .Set("before_frame", arg::Frame(e.before.number))
        .Set("sync_source", arg::Text(family.source_with_dc));
    if (e.crept > 0) {
      finding.Set("frames", arg::Count(e.crept, "frame"))
          .Set("pulses", arg::Count(e.empty > 0 ? e.crept + e.empty : e.crept - 1, "pulse"));
    }
    SetRemedy(finding, e);
    return Report(e.empty > 0 ? 1 : 2, std::move(finding));
  }

  /// What the next step depends on. SYNC0 in the middle between two frames must not be shifted.
  void SetRemedy(Finding& finding, const sync::SyncSlotMiss& e) const {
    if (e.crept > 0) return;
    // In another rhythm they arrive anywhere.
    const sync::CyclicImage* image = context().sync().outputs(e.slave).image;
    const TimeNs rhythm = image != nullptr && image->has_nominal() ? image->nominal_ns : e.cycle_ns;
    if (std::abs(static_cast<double>(rhythm) / static_cast<double>(e.cycle_ns) - 1) > kOtherRhythm) {
      finding.Set("frame_cycle_us", arg::Us(rhythm));
      return;
    }
    const TimeNs usual = context().sync().outputs(e.slave).phase.UsualNs(e.cycle_ns);
    if (usual < e.cycle_ns / 4 || usual > e.cycle_ns - e.cycle_ns / 4) {
      finding.Set("near_sync0", arg::Flag());
    } else {
      finding.Set("usual_phase_us", arg::Us(usual));
    }
  }

  void On(const sync::ArrivalOff& e) {
    const device::DeviceDescription& profile = *context().slave(e.slave).profile;
    const device::JitterLimit* limit = sync::LimitFor(context().slave(e.slave), e.cycle_ns);
    if (limit == nullptr) return;
    if (!e.uncertainty_ns) {
      NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, e.frame.number);
      return;
    }
    const bool missing = e.missing > 0;
    if (missing && e.unreturned > 0) {
      NotEvaluable(e.slave, ReasonCode::kNeverReturned, what::kProcessFrames, e.frame.number);
      return;
    }
    if (missing && MayMissBetween(e.before, e.frame)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, e.frame.number);
      return;
    }
    const TimeNs size = e.deviation_ns < 0 ? -e.deviation_ns : e.deviation_ns;
    if (!missing && size - *e.uncertainty_ns <= limit->jitter) {
      NotEvaluable(e.slave, ReasonCode::kWithinUncertainty, kJitter, e.frame.number);
      return;
    }
    const std::uint64_t key = missing ? 3 : 4;
    if (const FindingIndex index = Repeat(e.slave, key, e.frame); index != kNoFinding) {
      AddRelated(context().store[index], e.frame.number);
      return;
    }
    Finding finding = Found(missing ? kEmptyCycle : e.deviation_ns > 0 ? kLate : kEarly, e.slave, e.frame);
    AddRelated(finding, e.before.number);
    finding.reference = ReferenceTo(limit->source);
    finding.Set("deviation_us", arg::Us(e.deviation_ns))
        .Set("permitted_us", arg::Us(limit->jitter))
        .Set("missing_cycles", arg::Count(e.missing, "cycle"))
        .Set("time_base", arg::Of(WordOf(e.base)))
        .Set("uncertainty_us", arg::Us(*e.uncertainty_ns))
        .Set("cycle_us", arg::Us(e.cycle_ns))
        .Set("before_frame", arg::Frame(e.before.number));
    if (finding.kind == &kEarly) finding.Set("early_us", arg::Us(size));
    if (limit->undocumented) finding.Set("note", arg::Text(limit->note));
    SetManual(finding, profile);
    Report(key, limit->undocumented && !missing ? Severity::kWarning : Severity::kError, std::move(finding));
  }

  void On(const sync::PllMeasured& e) {
    const model::SlaveModel& slave = context().slave(e.slave);
    const device::SyncDescription& family = slave.profile->sync;
    const auto distance = model::ValueOf(slave, family.sync_distance);
    const auto window = model::ValueOf(slave, family.sync_window);
    if (!distance || !window) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, distance ? kPllWindow : kPllDistance, e.frame.number);
      return;
    }
    if (*e.inside() || Repeat(e.slave, 5, e.frame) != kNoFinding) return;
    Finding finding = Found(kPllOutside, e.slave, e.frame);
    if (distance->since != 0) AddRelated(finding, distance->since);
    if (window->since != 0) AddRelated(finding, window->since);
    finding.reference = ReferenceTo(family.sync_actual->source);
    if (e.inferred) finding.confidence = Confidence::kInferred;
    finding.Set("sync_actual", arg::Number(e.actual))
        .Set("sync_distance", arg::Number(distance->value))
        .Set("sync_window", arg::Number(window->value))
        .Set("actual_parameter", arg::Text(family.sync_actual->keyword))
        .Set("distance_parameter", arg::Text(family.sync_distance->keyword))
        .Set("window_parameter", arg::Text(family.sync_window->keyword));
    SetOrigin(finding, "distance_object", "distance_frame", *family.sync_distance, *distance);
    SetOrigin(finding, "window_object", "window_frame", *family.sync_window, *window);
    if (e.threshold) {
      finding.Set("threshold", arg::Count(static_cast<std::uint64_t>(*e.threshold), "consecutive cycle"));
    }
    SetManual(finding, *slave.profile);
    Report(5, std::move(finding));
  }

  void Finish() override {
    // A late frame leaves one interval empty, and it or its successor makes another one have two.
    for (std::size_t s = 0; s < misses_.size(); ++s) {
      const auto& [empty, doubled] = misses_[s].of;
      // If there are too many findings, they count on others.
      const auto own = [&](FindingIndex index) { return index != kNoFinding && context().store[index].slave == s; };
      if (!own(empty.index) || !own(doubled.index) || empty.index == doubled.index) continue;
      if (doubled.first_ones == 0) context().store[doubled.index].caused_by = empty.index;
      if (empty.first_ones == 0) context().store[empty.index].caused_by = doubled.index;
    }
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const sync::OutputWatch& outputs = context().sync().outputs(id);
      const auto& settings = context().sync().dc(id).activated();  // the last run may have ended in INIT
      if (outputs.frames_in_op == 0 || !settings || !settings->activation.sync0()) continue;
      if (context().slave(id).profile->sync.source_with_dc.empty()) {
        FinishAnySlave(id, outputs);
        continue;
      }
      if (outputs.phase.frames() == 0) {
        NotEvaluable(id, ReasonCode::kNotInCapture, kDcTime);
      } else if (outputs.phase.undecided() > 0 && !outputs.phase.missed()) {
        NotEvaluable(id, ReasonCode::kAmbiguous, kNearSync0, outputs.phase.first_undecided().number);
      }
    }
  }

 private:
  [[nodiscard]] bool MayMissBetween(const FrameRef& before, const FrameRef& frame) const {
    return context().network().MayMissBetween(before.number, frame.number);
  }

  /// Intervals of one slave without a frame, or with two.
  struct Kind {
    FindingIndex index = kNoFinding;
    std::uint64_t first_ones = 0;  ///< that make up for none of the other kind before them
  };
  struct Misses {
    std::array<Kind, 2> of;  ///< without a frame, with two
    std::int64_t late = 0;   ///< intervals by which frames are later than at first
  };

  /// Intervals of a slave of which it is unknown whether it needs one frame in each.
  struct Irregular {
    FrameRef first, last;
    FrameNo longest_before = 0, longest_after = 0;
    std::uint64_t empty = 0, doubled = 0;
    std::uint64_t longest = 0;               ///< intervals without a frame, one after the other
    TimeNs shortest_ns = 0, longest_ns = 0;  ///< between two frames, by the stamps
    std::uint32_t cycle_ns = 0;

    void Add(const sync::SyncSlotMiss& e) {
      if (!first.seen()) first = e.frame;
      last = e.frame;
      cycle_ns = e.cycle_ns;
      (e.empty > 0 ? empty : doubled) += std::max<std::uint64_t>(e.empty, 1);
      longest = std::max(longest, e.empty);
      if (e.crept > 0 || !e.before.has_time || !e.frame.has_time) return;
      const TimeNs apart = Elapsed(e.before.time, e.frame.time);
      if (apart <= 0) return;
      if (shortest_ns == 0 || apart < shortest_ns) shortest_ns = apart;
      if (apart <= longest_ns) return;
      longest_ns = apart;
      longest_before = e.before.number;
      longest_after = e.frame.number;
    }
    /// By their stamps the frames do not come with the cycle.
    [[nodiscard]] bool Stamped() const {
      return shortest_ns > 0 && longest_ns > cycle_ns + cycle_ns / 4 && shortest_ns < cycle_ns - cycle_ns / 4;
    }
  };

  Irregular& OfAnySlave(SlaveId slave) {
    if (slave >= irregular_.size()) irregular_.resize(static_cast<std::size_t>(slave) + 1);
    return irregular_[slave];
  }

  void FinishAnySlave(SlaveId slave, const sync::OutputWatch& outputs) {
    if (slave >= irregular_.size() || !irregular_[slave].first.seen()) return;
    const Irregular& misses = irregular_[slave];
    const std::uint64_t missed = misses.empty + misses.doubled;
    const std::uint64_t intervals = outputs.phase.frames() + misses.empty;
    // Frames that come late leave one interval empty and fill another one twice. A master with another cycle, or with a
    // second task, does mostly one of both.
    const std::uint64_t apart = std::max(misses.empty, misses.doubled) - std::min(misses.empty, misses.doubled);
    const bool in_rhythm = apart * kUnbalancedOneIn <= missed;
    if (!in_rhythm || missed < kManyMissed || missed * kMissedOneIn < intervals) {
      NotEvaluable(slave, ReasonCode::kNotInProfile, kSyncSource, misses.first.number);
      return;
    }
    Finding finding = Found(kIrregular, slave, misses.first);
    finding.confidence = Confidence::kInferred;
    finding.last = misses.last;
    finding.count = missed;
    finding.reference = ReferenceTo("ESC-1, distributed clocks, SYNC signal generation");
    const double share = 100.0 * static_cast<double>(missed) / static_cast<double>(intervals);
    finding.Set("missed_share", arg::Real(share, "%", share < 10 ? 1 : 0))
        .Set("empty_intervals", arg::Count(misses.empty, "interval"))
        .Set("double_intervals", arg::Count(misses.doubled, "interval"))
        .Set("intervals", arg::Count(intervals, "interval"))
        .Set("cycle_us", arg::Us(misses.cycle_ns));
    if (misses.longest > 1) finding.Set("longest_run", arg::Count(misses.longest, "interval"));
    if (misses.Stamped()) {
      finding.Set("shortest_us", arg::Us(misses.shortest_ns)).Set("longest_us", arg::Us(misses.longest_ns));
      AddRelated(finding, misses.longest_before);
      AddRelated(finding, misses.longest_after);
    }
    Report(6, Severity::kWarning, std::move(finding));
  }

  /// Whether the miss is the other end of one before it: frames came back to their places.
  void Follow(const sync::SyncSlotMiss& e, FindingIndex index) {
    if (e.slave >= misses_.size()) misses_.resize(static_cast<std::size_t>(e.slave) + 1);
    Misses& misses = misses_[e.slave];
    Kind& kind = misses.of[e.empty > 0 ? 0 : 1];
    kind.index = index;
    const bool makes_up = e.empty > 0 ? misses.late < 0 : misses.late > 0;
    const bool left_out = IsLeftOut(e);
    if (left_out || !makes_up) ++kind.first_ones;
    if (!left_out) misses.late += e.empty > 0 ? static_cast<std::int64_t>(e.empty) : -1;
  }

  /// The frames before and after the empty intervals are in their places: there was none between them.
  static bool IsLeftOut(const sync::SyncSlotMiss& e) {
    if (e.empty == 0 || !e.before.has_time || !e.frame.has_time) return false;
    const auto cycles = static_cast<double>(Elapsed(e.before.time, e.frame.time)) / static_cast<double>(e.cycle_ns);
    const std::uint64_t pulses = std::max<std::uint64_t>(e.crept, 1) + e.empty;
    return std::abs(cycles - static_cast<double>(pulses)) < kInPlace;
  }

  /// The object and frame that showed a parameter; neither if the user gave it.
  static void SetOrigin(Finding& finding, std::string_view object, std::string_view frame,
                        const device::DriveParameter& parameter, const model::ParameterValue& value) {
    if (value.since == 0 || !parameter.object) return;
    finding.Set(object, arg::Object(parameter.object->index, parameter.object->subindex))
        .Set(frame, arg::Frame(value.since));
  }

  std::vector<Misses> misses_;        // by slave
  std::vector<Irregular> irregular_;  // likewise
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncWindowViolation>};

}  // namespace
}  // namespace ecaudit::sync_window_violation
