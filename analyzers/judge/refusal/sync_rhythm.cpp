#include <cmath>

#include "analyzers/judge/refusal/checks.h"
#include "analyzers/judge/refusal/evidence.h"
#include "analyzers/judge/refusal/thresholds.h"
#include "analyzers/judge/sync_text.h"

namespace ecaudit::refusal {
namespace {

/// A slave counts what it misses before it leaves OP. One that ran for long did not leave because of its rhythm.
bool HadNoTimeToShow(const Case& of) {
  if (of.requested()) return of.Counts(of.sync_changed());
  return of.refusal.shown <= of.refusal.held_since + threshold::kShortlyFrames;
}

/// @param frame_ns  between two frames with outputs
RateVerdict VerdictOnRate(const Case& of, const Outcome& found, TimeNs frame_ns, TimeNs cycle_ns) {
  const auto frame = static_cast<double>(frame_ns);
  const double cycles = frame / static_cast<double>(cycle_ns);
  Facts<RateFact> facts{};
  facts.Set(RateFact::kNoMultiple, CycleDeviation(of.model, frame, cycle_ns) > kCycleTolerance);
  facts.Set(RateFact::kSame, std::abs(cycles - 1) <= kCycleTolerance);
  facts.Set(RateFact::kFaster, cycles < 1);
  facts.Set(RateFact::kSlower, cycles > 1);
  facts.Set(RateFact::kMayBeReason, of.Counts(of.sync_changed()));
  facts.Set(RateFact::kNoTimeToShow, HadNoTimeToShow(of));
  facts.Set(RateFact::kSync1, of.sync1());
  facts.Set(RateFact::kOtherReason, !found.none());
  return Decide(kRates, facts);
}

}  // namespace

void CheckRate(const Case& of, Outcome& found) {
  const auto cycle = of.sync0_cycle_ns();
  const sync::CyclicImage* image = of.context.sync().outputs(of.refusal.slave).image;
  if (cycle.value_or(0) == 0 || image == nullptr || !image->has_nominal()) return;
  const TimeNs cycle_ns{*cycle};
  const bool one_per_cycle = NeedsOneFrameACycle(of.model);
  Arguments arguments{{"rate_us", arg::Us(image->nominal_ns)},
                      {"cycle_us", arg::Us(cycle_ns)},
                      {"one_per_cycle", arg::Flag(one_per_cycle)}};
  switch (VerdictOnRate(of, found, image->nominal_ns, cycle_ns)) {
    case RateVerdict::kNothing:
      return;
    case RateVerdict::kRight:
      return found.Right(kRateFits);
    case RateVerdict::kDiffers:
      if (!one_per_cycle) arguments.Set("neither", arg::Flag());
      break;
    case RateVerdict::kSeveralFrames:
      arguments.Set("several", arg::Flag());
      break;
    case RateVerdict::kSeveralPulses: {
      const std::int64_t pulses = std::llround(static_cast<double>(image->nominal_ns) / static_cast<double>(cycle_ns));
      arguments.Set("pulses", arg::Number(pulses)).Set("empty", arg::Number(pulses - 1));
    }
  }
  found.May(kRateDiffers, std::move(arguments));
}

void CheckArrival(const Case& of, Outcome& found) {
  const sync::OutputWatch& outputs = of.context.sync().outputs(of.refusal.slave);
  const sync::Sync0Phase* phase = of.requested() ? outputs.safeop_phase.get() : &outputs.phase;
  const auto cycle = of.sync0_cycle_ns();
  if (!found.none() || !of.ExchangeCounts() || !cycle || phase == nullptr) return;
  const std::uint64_t frames = phase->frames();
  const TimeNs cycle_ns{*cycle};
  if (frames < threshold::kRhythmFrames || phase->uncertainty_ns() * threshold::kVagueOneIn > cycle_ns) return;
  const sync::Sync0Phase::Misses& misses = phase->misses();
  if (misses.empty > frames) return;  // another rhythm
  const std::uint64_t intervals = frames + misses.empty;
  const std::uint64_t missed = misses.empty + misses.doubled;
  Arguments arguments{{"cycle_us", arg::Us(cycle_ns)},
                      {"arrived", arg::Count(frames, "frame")},
                      {"uncertainty_us", arg::Us(phase->uncertainty_ns())}};
  if (missed * threshold::kMissedOneIn >= intervals) {
    const double share = 100.0 * static_cast<double>(missed) / static_cast<double>(intervals);
    arguments.Set("empty", arg::Number(static_cast<std::int64_t>(misses.empty)))
        .Set("doubled", arg::Number(static_cast<std::int64_t>(misses.doubled)))
        .Set("intervals", arg::Count(intervals, "interval"))
        .Set("share", arg::Real(share, "%", share < 10 ? 1 : 0));
    if (misses.longest > 0) arguments.Set("longest", arg::Count(misses.longest, "interval"));
    found.May(kIntervalsMissed, std::move(arguments));
  } else if (misses.undecided * threshold::kAtPulseOneIn >= frames) {
    arguments.Set("at_pulse", arg::Number(static_cast<std::int64_t>(misses.undecided)));
    found.May(kAtPulse, std::move(arguments));
  } else if (missed + misses.undecided == 0) {
    found.Right(kArrivalFits);
  }
}

}  // namespace ecaudit::refusal
