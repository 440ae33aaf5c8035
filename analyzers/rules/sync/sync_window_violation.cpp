#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
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

namespace ecaudit::sync_window_violation {
namespace {

/// The rhythm of the frames is not that of SYNC0 (sync-cycle-mismatch) where it is off by more than this part.
constexpr double kOtherRhythm = 0.1;
/// Frames are as far apart as their intervals within this part of a cycle.
constexpr double kInPlace = 0.125;

constexpr RuleInfo kInfo{
    .id = "sync-window-violation",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .of_family = true,
    .subject = Subject::kTiming,
    .title = "Process data arrive outside the window in which the drive expects them",
    .needs =
        "with SYNC0: DC time in the frames with process data; without: the family's permitted jitter and good stamps",
    .source = "AKD-2011, 4.10; AKD-2010, 4.10; MKD, 4.11; PILZ, 4.8",
    .doc = R"(
## What it checks
With SYNC0 in OP: that one frame with outputs arrives between two pulses. A pulse interval without a frame, or with
two, means that a frame came on the wrong side of SYNC0. Where the master reads the drive's own measurement (AKD and
MKD: SYNCACT, 3496h:2), that it lies inside SYNCDIST +- SYNCWND. Without SYNC0: that outputs arrive within the jitter
that the family permits (Pilz: 320 us for cycles of 1 ms and more, 70 us up to 750 us), and none is missing.

## Why it matters
At SYNC0 the drive takes the outputs it has. An interval without new ones repeats old setpoints, one with two skips a
setpoint: the axis jerks. Without SYNC0 a Pilz drive counts the violation; the second in a row is a loss of
synchronisation.

## How it is decided
The arrival is the DC time that the frame itself carries, plus the slave's propagation delay, plus the length of the
frame; it is on no side while it lies within 1 us (or the slave's own 0x092C) of a pulse. Frames that creep over a pulse
do so inside of that: so frames and pulses are counted from the last frame whose side is certain, as long as no interval
is so long that a frame may be missing in it. Where the frames themselves carry no time but others of the cycle do,
certain is for this count what lies a quarter of the cycle off. Without SYNC0 the expected arrival lies on the line
through the frames so far, which it follows slowly, from the 100th cycle in OP on; the limit is that for 60C2h where the
master wrote it and its cycle is about that, else for the measured cycle. Stamps that are too poor, or a deviation that
equals the limit within their uncertainty and that of the line, are not judged; neither are frames that were sent and
did not return, nor 64 and more missing cycles of a drive that stays enabled (the capture has a hole there). A frame
that is late leaves an interval empty and makes the next one have two: where each of the ones makes up for one of the
others before it, caused_by names these. SYNCACT counts in OP with SYNC0 on, after PLLTHRESH cycles where that is known;
SYNCDIST and SYNCWND come from SDO transfers or from --parameter. The AKD manuals do not print these objects: they are
those of the MKD, and the finding is inferred. Only families that are known to synchronise this way are judged. Between
750 us and 1 ms the Pilz manual gives no figure: 70 us is applied as a warning.

## Example
tests/rules/sync-window-violation/violates.trace

## What to do
Shift SYNC0 (start time) to the middle between two frames, and make the master's sending more regular. The report
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
    if (family.source_with_dc.empty()) {
      NotEvaluable(e.slave, "the profile does not say how the slave synchronises to SYNC0", e.frame.number);
      return;
    }
    if (e.empty > 0 && e.unreturned > 0) {
      NotEvaluable(e.slave, "frames for a SYNC0 interval were sent and did not return", e.frame.number);
      return;
    }
    if (IsHole(context().sync().outputs(e.slave), e.empty)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kPauseOfDrive, e.frame.number);
      return;
    }
    if (e.empty > 0 && context().network().MayMissBetween(e.before.number, e.frame.number)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, e.frame.number);
      return;
    }
    if (const sync::DcClock& clock = context().sync().clock();
        e.crept > 0 && clock.distributions() == 0 && e.slave != clock.reference()) {
      NotEvaluable(e.slave, "the frames creep over SYNC0 by a clock that the slave's own need not follow",
                   e.frame.number);
      return;
    }
    FindingIndex index = Repeat(e.slave, e.empty > 0 ? 1 : 2, e.frame);
    if (index != kNoFinding) {
      AddRelated(context().store[index], e.frame.number);
    } else {
      index = TellMiss(e, family);
    }
    Follow(e, index);
  }

  FindingIndex TellMiss(const sync::SyncSlotMiss& e, const device::SyncDescription& family) {
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    AddRelated(finding, e.before.number);
    const std::string cycle = Duration(e.cycle_ns);
    finding.title = e.empty == 0   ? "Two frames with process data in one SYNC0 interval"
                    : e.empty == 1 ? "SYNC0 interval without process data"
                                   : std::to_string(e.empty) + " SYNC0 intervals without process data";
    finding.message = "SYNC0 comes every " + cycle + ". " + MissText(e) + "; the latter arrives " +
                      Duration(e.phase_ns) + " after a pulse, +-" + Duration(e.uncertainty_ns) + " by the DC time in " +
                      (e.by_stamps ? "another frame of the cycle and the stamps" : "the frames") +
                      ". The drive needs one frame in each interval (" + family.source_with_dc + "). " + AdviceOn(e);
    finding.evidence = {Number("empty_intervals", static_cast<std::int64_t>(e.empty)),
                        Real("phase_us", static_cast<double>(e.phase_ns) / 1e3),
                        Real("cycle_us", static_cast<double>(e.cycle_ns) / 1e3)};
    return Report(e.empty > 0 ? 1 : 2, std::move(finding));
  }

  /// SYNC0 in the middle between two frames is not to be shifted.
  [[nodiscard]] std::string AdviceOn(const sync::SyncSlotMiss& e) const {
    if (e.crept > 0) return "Let the master's cycle follow the DC time.";
    // In another rhythm they arrive anywhere.
    const sync::CyclicImage* image = context().sync().outputs(e.slave).image;
    const TimeNs rhythm = image != nullptr && image->has_nominal() ? image->nominal_ns : e.cycle_ns;
    if (std::abs(static_cast<double>(rhythm) / static_cast<double>(e.cycle_ns) - 1) > kOtherRhythm) {
      return "Let the frames come with the cycle of SYNC0: they come every " + Duration(rhythm) + ".";
    }
    const TimeNs usual = context().sync().outputs(e.slave).phase.UsualNs(e.cycle_ns);
    if (usual < e.cycle_ns / 4 || usual > e.cycle_ns - e.cycle_ns / 4) {
      return "Shift SYNC0 to the middle between two frames, and send more regularly.";
    }
    return "On average the frames arrive " + Duration(usual) +
           " after a pulse, far from the next: look for what delayed the master here, or whether its cycle follows the "
           "DC time.";
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
      NotEvaluable(e.slave, "frames with process data were sent and did not return", e.frame.number);
      return;
    }
    const TimeNs size = e.deviation_ns < 0 ? -e.deviation_ns : e.deviation_ns;
    if (!missing && size - *e.uncertainty_ns <= limit->jitter) {
      NotEvaluable(
          e.slave,
          "jitter of the process data equals the permitted one within the uncertainty of what it is measured by",
          e.frame.number);
      return;
    }
    const std::uint64_t key = missing ? 3 : 4;
    if (const FindingIndex index = Repeat(e.slave, key, e.frame); index != kNoFinding) {
      AddRelated(context().store[index], e.frame.number);
      return;
    }
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    AddRelated(finding, e.before.number);
    finding.reference = ReferenceTo(limit->source);
    const std::string permitted = Duration(limit->jitter);
    finding.title = missing ? Count(e.missing, "cycle") + " without process data"
                            : "Process data " + Duration(size) + (e.deviation_ns > 0 ? " late" : " early") +
                                  ", permitted are " + permitted;
    finding.message =
        (missing ? "Between frame " + std::to_string(e.before.number) + " and frame " + std::to_string(e.frame.number) +
                       " " + Count(e.missing, "cycle") + " of " + Duration(e.cycle_ns) + " passed without outputs"
                 : "Frame " + std::to_string(e.frame.number) + " comes " + Duration(size) +
                       (e.deviation_ns > 0 ? " later" : " earlier") + " than the cycles of " + Duration(e.cycle_ns) +
                       " before it let expect") +
        PrecisionText({0, e.base}, *e.uncertainty_ns) + ". " + LawText(profile) + " permits a jitter of " + permitted +
        (limit->undocumented ? " (" + limit->note + ")" : std::string()) + ". Make the master's sending more regular.";
    finding.evidence = {Real("deviation_us", static_cast<double>(e.deviation_ns) / 1e3),
                        Real("permitted_us", static_cast<double>(limit->jitter) / 1e3),
                        Number("missing_cycles", static_cast<std::int64_t>(e.missing)),
                        Text("time_base", std::string(sync::Name(e.base)))};
    Report(key, limit->undocumented && !missing ? Severity::kWarning : Severity::kError, std::move(finding));
  }

  void On(const sync::PllMeasured& e) {
    const model::SlaveModel& slave = context().slave(e.slave);
    const device::SyncDescription& family = slave.profile->sync;
    const auto distance = model::ValueOf(slave, family.sync_distance);
    const auto window = model::ValueOf(slave, family.sync_window);
    if (!distance || !window) {
      NotEvaluable(e.slave,
                   (distance ? family.sync_window : family.sync_distance)->keyword +
                       " is not known, which the drive's measurement of its synchronisation is compared with: give it "
                       "with --parameter",
                   e.frame.number);
      return;
    }
    if (*e.inside() || Repeat(e.slave, 5, e.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    if (distance->since != 0) AddRelated(finding, distance->since);
    if (window->since != 0) AddRelated(finding, window->since);
    finding.reference = ReferenceTo(family.sync_actual->source);
    if (e.inferred) finding.confidence = Confidence::kInferred;
    finding.title = "The drive measures its PLL outside the window: " + family.sync_actual->keyword + " " +
                    std::to_string(e.actual) + ", expected " + std::to_string(distance->value) + " +-" +
                    std::to_string(window->value);
    finding.message = "In OP with SYNC0 on the drive answers in frame " + std::to_string(e.frame.number) + " that " +
                      family.sync_actual->keyword + " is " + std::to_string(e.actual) + ". " +
                      model::ParameterText(*family.sync_distance, *distance) + "; " +
                      model::ParameterText(*family.sync_window, *window) + ". " + LawText(*slave.profile) +
                      " lets the drive be synchronised only strictly inside" +
                      (e.threshold ? ", for " + Count(static_cast<std::uint64_t>(*e.threshold), "consecutive cycle")
                                   : std::string()) +
                      ". Make the master's cycle more regular, or check that it sends with the cycle of SYNC0.";
    finding.evidence = {Number("sync_actual", e.actual), Number("sync_distance", distance->value),
                        Number("sync_window", window->value)};
    Report(5, std::move(finding));
  }

  void Finish() override {
    // A frame that is late leaves one interval empty, and fills another one twice, or its successor does.
    for (std::size_t s = 0; s < misses_.size(); ++s) {
      const auto& [empty, doubled] = misses_[s].of;
      // Where findings are too many they count on others.
      const auto own = [&](FindingIndex index) { return index != kNoFinding && context().store[index].slave == s; };
      if (!own(empty.index) || !own(doubled.index) || empty.index == doubled.index) continue;
      if (doubled.first_ones == 0) context().store[doubled.index].caused_by = empty.index;
      if (empty.first_ones == 0) context().store[empty.index].caused_by = doubled.index;
    }
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const sync::OutputWatch& outputs = context().sync().outputs(id);
      const auto& settings = context().sync().dc(id).told();  // the last run may have ended in INIT
      if (outputs.frames_in_op == 0 || !settings || !settings->activation.sync0()) continue;
      if (context().slave(id).profile->sync.source_with_dc.empty()) continue;
      if (outputs.phase.frames() == 0) {
        NotEvaluable(id, "the frames with process data carry no DC time to compare with SYNC0");
      } else if (outputs.phase.undecided() > 0 && !outputs.phase.missed()) {
        NotEvaluable(id, "frames with process data arrive so near to SYNC0 that the clocks do not tell on which side",
                     outputs.phase.first_undecided().number);
      }
    }
  }

 private:
  /// Intervals of one slave without a frame, or with two.
  struct Kind {
    FindingIndex index = kNoFinding;
    std::uint64_t first_ones = 0;  ///< that make up for none of the other kind before them
  };
  struct Misses {
    std::array<Kind, 2> of;   ///< without a frame, with two
    std::int64_t behind = 0;  ///< by so many intervals frames are later than at first
  };

  /// Whether the miss is the other end of one before it: frames came back to their places.
  void Follow(const sync::SyncSlotMiss& e, FindingIndex index) {
    if (e.slave >= misses_.size()) misses_.resize(static_cast<std::size_t>(e.slave) + 1);
    Misses& misses = misses_[e.slave];
    Kind& kind = misses.of[e.empty > 0 ? 0 : 1];
    kind.index = index;
    const bool makes_up = e.empty > 0 ? misses.behind < 0 : misses.behind > 0;
    const bool left_out = IsLeftOut(e);
    if (left_out || !makes_up) ++kind.first_ones;
    if (!left_out) misses.behind += e.empty > 0 ? static_cast<std::int64_t>(e.empty) : -1;
  }

  /// The frames before and behind the empty intervals are in their places: there was none between them.
  static bool IsLeftOut(const sync::SyncSlotMiss& e) {
    if (e.empty == 0 || !e.before.has_time || !e.frame.has_time) return false;
    const auto cycles = static_cast<double>(Elapsed(e.before.time, e.frame.time)) / static_cast<double>(e.cycle_ns);
    const std::uint64_t pulses = std::max<std::uint64_t>(e.crept, 1) + e.empty;
    return std::abs(cycles - static_cast<double>(pulses)) < kInPlace;
  }

  static std::string MissText(const sync::SyncSlotMiss& e) {
    const std::string before = std::to_string(e.before.number);
    const std::string frame = std::to_string(e.frame.number);
    const std::string intervals = Count(e.empty, "interval") + " between two pulses passed without outputs";
    if (e.crept > 0) {
      const std::string frames =
          "From frame " + before + " to frame " + frame + " " + Count(e.crept, "frame") + " and ";
      return e.empty > 0
                 ? frames + Count(e.crept + e.empty, "pulse") + " came: the frames creep over SYNC0, and " + intervals
                 : frames + Count(e.crept - 1, "pulse") +
                       " came: the frames creep over SYNC0, and two arrive between the same two pulses";
    }
    if (e.empty == 0) return "Frames " + before + " and " + frame + " both arrive between the same two pulses";
    return "Between frame " + before + " and frame " + frame + " " + intervals;
  }

  std::vector<Misses> misses_;  // by slave
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncWindowViolation>};

}  // namespace
}  // namespace ecaudit::sync_window_violation
