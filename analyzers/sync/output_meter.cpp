#include "analyzers/sync/output_meter.h"

#include <cmath>
#include <cstdlib>
#include <memory>

#include "analyzers/model/drive_parameters.h"

namespace ecaudit::sync {
namespace {

/// Part of a cycle by which the measured one may be off: more is another cycle, which sync-cycle-mismatch reports.
constexpr TimeNs kSameCycle = 10;
/// Families print their limits for cycles of whole steps of this, ns.
constexpr TimeNs kCycleStep = 10'000;
/// Frames: a quarter of those that a new rhythm rests on. If that number is missing, it may be the old one.
constexpr std::uint64_t kManyMissing = kEnoughIntervals / 4;

}  // namespace

TimeNs ConfiguredOr(const model::SlaveModel& slave, TimeNs measured) {
  const std::optional<TimeNs> configured = model::InterpolationTime(slave);
  return configured && std::abs(measured - *configured) <= *configured / kSameCycle ? *configured : measured;
}

const device::JitterLimit* LimitFor(const model::SlaveModel& slave, TimeNs measured) {
  return slave.profile->sync.FindJitter((ConfiguredOr(slave, measured) + kCycleStep / 2) / kCycleStep * kCycleStep);
}

void OutputMeter::Feed(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand,
                       const CyclicImage* image) {
  // What comes late was in its place when it was sent.
  if (watch.seen && at_hand.time().frame.number <= watch.last.frame.number) return;
  const bool in_op = bus_.slave(id).al.SettledIn(esc::AlState::OP);
  if (watch.Waits() && (in_op || watch.fell.seen())) FollowInterval(id, watch, dc, at_hand, image, in_op);
  const bool counts = dc.pulse_cycle_ns() > 0 && at_hand.dc();
  if (in_op && counts) {
    watch.in_safeop = false;
    MeasurePhase(id, watch, dc, at_hand);
  } else {
    watch.phase.End();
    watch.in_safeop = watch.in_safeop && counts;
    if (counts) MeasureBeforeOp(id, watch, dc, at_hand);
  }
  watch.Add(at_hand.time(), at_hand.sent().number, image, in_op);
}

/// Before OP nothing is reported of it, but a slave that does not reach OP may have its reason there.
void OutputMeter::MeasureBeforeOp(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand) {
  const auto doubt = bus_.slave(id).al.SettledIn(esc::AlState::SAFEOP) ? DoubtOf(at_hand) : std::nullopt;
  if (doubt && !watch.in_safeop) watch.safeop_phase = std::make_unique<Sync0Phase>();
  watch.in_safeop = doubt.has_value();
  if (doubt) Place(id, *watch.safeop_phase, dc, at_hand, *doubt);
}

[[gnu::always_inline]] inline void OutputMeter::FollowInterval(SlaveId id, OutputWatch& watch, const DcUnit& dc,
                                                               const FrameAtHand& at_hand, const CyclicImage* image,
                                                               bool in_op) {
  const FrameTime& time = at_hand.time();
  const bool follows = watch.Follows(image);
  const Interval gap = watch.GapTo(time, follows);
  const TimeNs limit = watch.GapLimit(image);
  if (gap.base != TimeBase::kNone && limit > 0 && gap.ns >= limit) ReportGap(id, watch, at_hand, gap);
  const bool by_sync0 = dc.generates_sync0();
  // The grid begins again when its cycles do.
  if (!in_op || !watch.in_op || by_sync0) watch.grid.End();
  if (!in_op || !watch.in_op) return;
  const Interval rhythm = watch.RhythmTo(time, follows);
  if (watch.image != nullptr && watch.image->has_nominal()) {
    if (!watch.rate.Follows(*watch.image)) RenewRate(id, watch, dc, at_hand.sent().number);
    watch.rate.Add(rhythm, watch.last.frame, time.frame);
  }
  if (!by_sync0) MeasureArrival(id, watch, at_hand, rhythm);
}

void OutputMeter::ReportGap(SlaveId id, const OutputWatch& watch, const FrameAtHand& at_hand, const Interval& gap) {
  OutputGap event = watch.Describe(id, gap);
  event.uncertainty_ns = trust_.UncertaintyOfPause(gap.base);
  event.after = at_hand.time().frame;
  event.unreturned = Unreturned(id, watch.last_sent, at_hand.sent().number);
  sink_.Publish(event);
}

void OutputMeter::RenewRate(SlaveId id, OutputWatch& watch, const DcUnit& dc, FrameNo sent) {
  const TimeNs configured = dc.generates_sync0() ? TimeNs{dc.active()->sync0_cycle_ns.value_or(0)}
                                                 : model::InterpolationTime(bus_.slave(id)).value_or(0);
  // Many frames were sent since the intervals are others than before, and never returned so far.
  const bool missing =
      watch.rate.MayTurn(*watch.image, configured) && Unreturned(id, watch.rate.turn_from(), sent) >= kManyMissing;
  if (!watch.rate.Renew(*watch.image, configured, missing)) return;
  if (watch.rate.cycles() > 0) sink_.Publish(RateEnded{id});
  watch.rate.GoOnFromTurn(watch.last.frame);
}

void OutputMeter::EndRate(SlaveId id, OutputWatch& watch) {
  if (watch.rate.cycles() > 0) sink_.Publish(RateEnded{id});
  watch.rate.BeginAnew();
}

void OutputMeter::MeasureArrival(SlaveId id, OutputWatch& watch, const FrameAtHand& at_hand, const Interval& interval) {
  const model::SlaveModel& slave = bus_.slave(id);
  if (slave.profile->sync.jitter.empty()) return;
  if (interval.base == TimeBase::kNone || watch.image == nullptr || !watch.image->has_nominal()) {
    watch.grid.End();
    return;
  }
  if (!watch.grid.Follows(interval.base)) {
    watch.grid.Begin(interval.base, ConfiguredOr(slave, watch.image->nominal_ns));
  }
  const std::optional<ArrivalGrid::Arrival> arrival = watch.grid.Add(interval.ns);
  if (!arrival) return;
  std::optional<TimeNs> uncertainty = trust_.Uncertainty(interval.base);
  if (uncertainty) {  // clock and grid are wrong independently
    *uncertainty = static_cast<TimeNs>(
        std::hypot(static_cast<double>(*uncertainty), static_cast<double>(arrival->uncertainty_ns)));
  }
  const TimeNs off = std::abs(arrival->deviation_ns) + uncertainty.value_or(0);
  const device::JitterLimit* limit = LimitFor(slave, arrival->cycle_ns);
  if (limit == nullptr || (arrival->missing == 0 && off <= limit->jitter)) return;
  sink_.Publish(ArrivalOff{id, watch.last.frame, at_hand.time().frame, arrival->deviation_ns, arrival->missing,
                           arrival->cycle, arrival->cycle_ns, interval.base, uncertainty,
                           Unreturned(id, watch.last_sent, at_hand.sent().number)});
}

Sync0Phase::Arrival OutputMeter::Place(SlaveId id, Sync0Phase& phase, const DcUnit& dc, const FrameAtHand& at_hand,
                                       TimeNs doubt) {
  return phase.Add(dc, at_hand.time().frame, *at_hand.dc(), at_hand.has_wide_clock(), at_hand.WayTo(delays_.Of(id)),
                   doubt);
}

void OutputMeter::MeasurePhase(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand) {
  const FrameRef& frame = at_hand.time().frame;
  const std::optional<TimeNs> doubt = DoubtOf(at_hand);
  if (!doubt) return;
  const Sync0Phase::Arrival arrival = Place(id, watch.phase, dc, at_hand, *doubt);
  if (!arrival.measured) return;
  if (sink_.HasSubscribers<PhaseMeasured>()) sink_.Publish(PhaseMeasured{id, frame, arrival.phase_ns});
  if (!arrival.missed()) return;
  const FrameRef& before = arrival.since.seen() ? arrival.since : watch.last.frame;
  const FrameNo sent_before = arrival.since.seen() ? arrival.since.number : watch.last_sent;
  const std::uint64_t unreturned = arrival.doubled ? 0 : Unreturned(id, sent_before, at_hand.sent().number);
  sink_.Publish(SyncSlotMiss{id, before, frame, arrival.empty, arrival.frames, *dc.active()->sync0_cycle_ns,
                             arrival.phase_ns, watch.phase.uncertainty_ns(), !at_hand.time().dc, unreturned});
}

/// Where it ends no outputs came: only the stamps show how long it was.
/// @return unset: they do not
std::optional<OutputGap> OutputMeter::Pause(SlaveId id, const OutputWatch& watch, const FrameTime& since,
                                            const FrameRef& until) const {
  FrameTime end;
  if (until.has_time) end.stamp = until.time;
  const Interval gap = BetweenBy(TimeBase::kCapture, since, end);
  if (gap.base == TimeBase::kNone) return std::nullopt;
  OutputGap pause = watch.Describe(id, gap);
  pause.uncertainty_ns = trust_.UncertaintyOfPause(gap.base);
  return pause;
}

void OutputMeter::StarvedUntil(SlaveId id, const OutputWatch& watch, const FrameRef& fell, esc::AlWord to,
                               std::optional<std::uint16_t> code) {
  auto pause = Pause(id, watch, watch.WaitsSince().value_or(watch.last), fell);
  if (!pause) return;
  pause->fell = fell;
  pause->fell_to = to;
  pause->fell_code = code;
  pause->end = OutputGap::End::kFell;
  pause->unreturned = Unreturned(id, watch.last_sent, 0);
  sink_.Publish(*pause);
}

void OutputMeter::Starve(SlaveId id, const OutputWatch& watch, const FrameRef& until, OutputGap::End end) {
  const std::optional<FrameTime> since = watch.WaitsSince();
  if (watch.fell.seen() || !since) return;
  auto pause = Pause(id, watch, *since, until);
  // Without a watchdog it is the pause of the usual one: masters take less to stop before they ask.
  if (!pause || pause->gap.ns < (watch.watchdog_ns != 0 ? watch.watchdog_ns : OutputWatch::kUsualWatchdogNs)) return;
  pause->end = end;
  pause->after = until;
  pause->unreturned = Unreturned(id, since->frame.number, 0);
  sink_.Publish(*pause);
}

}  // namespace ecaudit::sync
