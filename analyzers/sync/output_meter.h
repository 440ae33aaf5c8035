/// in: frames with outputs for one slave.  out: OutputGap, ArrivalOff, SyncSlotMiss, PhaseMeasured, RateEnded.
///
/// Compares how outputs arrive with how they should; what came so far is in the slave's OutputWatch.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/bus_model.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/frame_at_hand.h"
#include "analyzers/sync/output_watch.h"
#include "analyzers/sync/sent_frames.h"
#include "analyzers/sync/slave_delays.h"
#include "analyzers/sync/time_trust.h"
#include "decoder/base/event_sink.h"

namespace ecaudit::sync {

/// The cycle that the master configured (60C2h) where the measured one is about that, else the measured one.
[[nodiscard]] TimeNs ConfiguredOr(const model::SlaveModel& slave, TimeNs measured);
/// The family's limit for a cycle that was measured: that for the configured one where it agrees, else a cycle of
/// 999.9 us counts as one of 1 ms. Null when there is none.
[[nodiscard]] const device::JitterLimit* LimitFor(const model::SlaveModel& slave, TimeNs measured);

/// A frame with process data for a slave in OP ended `phase` after SYNC0.
struct PhaseMeasured {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  TimeNs phase = 0;
};

class OutputMeter {
 public:
  /// All arguments must outlive the meter.
  OutputMeter(const model::BusModel& bus, const SentFrames& sent_frames, const TimeTrust& trust, SlaveDelays& delays,
              EventSink& sink)
      : bus_(bus), sent_frames_(sent_frames), trust_(trust), delays_(delays), sink_(sink) {}

  /// The frame brings outputs for the slave. @param image  of them; null: none
  void Feed(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand, const CyclicImage* image);
  /// Its outputs come in another rhythm from here on, or no more.
  void EndRate(SlaveId id, OutputWatch& watch);
  /// No outputs came before the slave was seen to have left OP: the gap lasted at least until then.
  void StarvedUntil(SlaveId id, const OutputWatch& watch, const FrameRef& fell, esc::AlWord to,
                    std::optional<std::uint16_t> code);
  /// The slave in OP has waited for outputs until this frame, and gets none any more.
  void Starve(SlaveId id, const OutputWatch& watch, const FrameRef& until, OutputGap::End end);

 private:
  void FollowInterval(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand,
                      const CyclicImage* image, bool in_op);
  // Seldom, and so no part of Feed().
  [[gnu::noinline]] void ReportGap(SlaveId id, const OutputWatch& watch, const FrameAtHand& at_hand,
                                   const Interval& gap);
  [[gnu::noinline]] void RenewRate(SlaveId id, OutputWatch& watch, const DcUnit& dc, FrameNo sent);
  [[gnu::noinline]] void MeasureArrival(SlaveId id, OutputWatch& watch, const FrameAtHand& at_hand,
                                        const Interval& interval);
  void MeasurePhase(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand);
  [[gnu::noinline]] void MeasureBeforeOp(SlaveId id, OutputWatch& watch, const DcUnit& dc, const FrameAtHand& at_hand);
  Sync0Phase::Arrival Place(SlaveId id, Sync0Phase& phase, const DcUnit& dc, const FrameAtHand& at_hand, TimeNs doubt);
  /// How wrong its DC time may be, ns; unset: where only the stamps show it, they are too poor.
  [[nodiscard]] std::optional<TimeNs> DoubtOf(const FrameAtHand& at_hand) const {
    return at_hand.time().dc ? std::optional<TimeNs>(0) : trust_.Uncertainty(TimeBase::kCapture);
  }
  [[nodiscard]] std::optional<OutputGap> Pause(SlaveId id, const OutputWatch& watch, const FrameTime& since,
                                               const FrameRef& until) const;
  /// Frames with outputs for the slave that were sent between these, and never returned so far. @param until 0: now
  [[nodiscard]] std::uint64_t Unreturned(SlaveId id, FrameNo since, FrameNo until) const {
    return sent_frames_.UnreturnedBetween(since, until, bus_.network().fmmus(id));
  }

  const model::BusModel& bus_;
  const SentFrames& sent_frames_;
  const TimeTrust& trust_;
  SlaveDelays& delays_;
  EventSink& sink_;
};

}  // namespace ecaudit::sync
