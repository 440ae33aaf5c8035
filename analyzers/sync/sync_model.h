/// in: decoder events.  out: SyncSwitchedOn, OutputGap, SyncSlotMiss, ArrivalOff, PllMeasured; figures of cycle and
/// clocks when the capture ends.
///
/// keeps: what belongs to the frame at hand, whose time may come after its process data; all else is kept by
///
///   CyclicImages  rhythm of the process data       DcUnit, DcClock  distributed clocks
///   OutputWatch   how outputs reach one slave      PllWatch         what the drive shows of its own clock
///   SentFrames    frames as they passed            TimeTrust        how good the stamps are
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/result/cycle_summary.h"
#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/dc_clock.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/output_watch.h"
#include "analyzers/sync/pll_watch.h"
#include "analyzers/sync/sent_frames.h"
#include "analyzers/sync/slave_delays.h"
#include "analyzers/sync/time_base.h"
#include "analyzers/sync/time_trust.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/pipeline.h"

namespace ecaudit::sync {

/// The cycle that the master configured (60C2h) where the measured one is about that, else the measured one.
[[nodiscard]] TimeNs ConfiguredOr(const model::SlaveModel& slave, TimeNs measured);
/// The family's limit for a cycle that was measured: that for the configured one where it agrees, else a cycle of
/// 999.9 us counts as one of 1 ms. Null when there is none.
[[nodiscard]] const device::JitterLimit* LimitFor(const model::SlaveModel& slave, TimeNs measured);

/// Process data of `image` came `interval` after the last ones, by its rhythm_base().
struct IntervalMeasured {
  const CyclicImage& image;
  FrameRef frame;
  TimeNs interval = 0;
};

/// A frame with process data for a slave in OP ended `phase` after SYNC0.
struct PhaseMeasured {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  TimeNs phase = 0;
};

class SyncModel final {
 public:
  /// @param bus  whence events come and where what is concluded goes
  /// All arguments must outlive the model. Made before all other subscribers: rules that receive process data find
  /// them measured.
  SyncModel(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus);

  void On(const FrameSeen& seen);
  void On(const track::LogicalAccess& access);
  void On(const track::Answered& answer);
  void On(const track::CaptureGap& gap);
  void On(const track::WriteDoubtful& write);
  void On(const track::RunBegan& run);
  void On(const track::SlaveFound& event);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const track::SlaveAccess& access);
  void On(const model::AlChangedByItself& change);
  void On(const model::AlErrorCode& code);
  void On(const track::AlRequest& request);
  void On(const track::AlStatusRead& read);
  /// The capture has ended.
  void Finish();

  [[nodiscard]] const DcUnit& dc(SlaveId slave) const;
  [[nodiscard]] const OutputWatch& outputs(SlaveId slave) const;
  [[nodiscard]] const DcClock& clock() const { return clock_; }
  /// The image that was exchanged most often since the run began; null when none was exchanged twice.
  [[nodiscard]] const CyclicImage* cycle() const { return images_.Busiest(); }
  /// How wrong an interval by this clock may be, ns; unset when the clock cannot be trusted at all.
  [[nodiscard]] std::optional<TimeNs> Uncertainty(TimeBase base) const { return trust_.Uncertainty(base); }

  /// What hardly any frame with process data takes longer than, ns; unset without enough good stamps.
  [[nodiscard]] std::optional<TimeNs> UsualRoundTrip() const { return trust_.UsualRoundTrip(); }

  /// Frames with process data for the slave that were sent between these two, and did not return so far.
  [[nodiscard]] std::uint64_t UnreturnedBetween(SlaveId slave, FrameNo from, FrameNo to) const {
    return sent_frames_.UnreturnedBetween(from, to, bus_.network().fmmus(slave));
  }
  /// Of the run with the most cycles.
  [[nodiscard]] CycleSummary SummariseCycle() const;
  /// Of the run that goes on.
  [[nodiscard]] CycleSummary SummariseRun() const;
  [[nodiscard]] BusDcSummary SummariseBus() const;
  /// Unset when nothing was seen of the slave's unit.
  [[nodiscard]] std::optional<DcSummary> Summarise(SlaveId slave) const;

 private:
  [[nodiscard]] std::optional<DelayOrigins> OriginsOf(const CyclicImage& image, const IntervalStatistics& best,
                                                      TimeBase base) const;
  /// A datagram with process data of the frame at hand; its time may come with a later datagram.
  struct ProcessDatagram {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::uint16_t wkc = 0;
    bool assumed = false;
    SlaveId slave = kNoSlave;  ///< whose memory it addresses; kNoSlave: logical memory

    /// Slaves may take outputs from it.
    [[nodiscard]] bool brings_outputs() const { return command != wire::Command::LRD && (wkc != 0 || assumed); }
  };
  /// When the frame at hand was sent, and what it takes to reach a slave.
  struct FrameWay {
    std::int64_t length_ns = 0;           ///< on the wire; 0 when not known
    std::int64_t reference_delay_ns = 0;  ///< delay register of the reference clock
    bool wide_clock = false;              ///< the reference clock has 64 bit
  };
  struct Slave {
    DcUnit dc;
    OutputWatch outputs;
    PllWatch pll;
    // As they were after the last access to them:
    bool fmmus_known = false;
    bool outputs_mapped = false;
  };
  /// The frame at hand, once for all slaves.
  struct FrameAtHand {
    FrameTime time;
    std::optional<DcTime> by_stamps;  ///< where the frame carried no DC time, but one shortly before did
    FrameWay way;
  };

  Slave& Of(SlaveId slave) { return slave < slaves_.size() ? *slaves_[slave] : Grow(slave); }
  Slave& Grow(SlaveId slave);
  [[nodiscard]] bool IsCopyOfLast(const wire::FrameView& frame) const;
  void BeginFrame(const FrameRef& sent, const FrameRef& returned);
  void Flush();
  [[nodiscard]] bool LookAtFrame(FrameAtHand& at_hand);
  [[nodiscard]] bool IsOfOp(const model::LogicalExpectation& expected) const;
  const CyclicImage* Measure(const ProcessDatagram& pending, const FrameTime& time, bool in_op);
  void FeedEach(const FrameAtHand& at_hand);
  [[nodiscard]] std::span<const ProcessDatagram> pending() const { return std::span(pending_).first(pending_count_); }
  void Feed(SlaveId id, const FrameAtHand& at_hand, const CyclicImage* image);
  void FollowInterval(SlaveId id, Slave& slave, const FrameTime& time, const CyclicImage* image, bool in_op);
  void MeasureArrival(SlaveId id, OutputWatch& watch, const FrameTime& time, const Interval& interval);
  void MeasurePhase(SlaveId id, Slave& slave, const FrameAtHand& at_hand);
  void MeasureAnyPhase(SlaveId id, Slave& slave, const FrameAtHand& at_hand, std::int64_t way);
  void MeasureInSafeop(SlaveId id, Slave& slave, const FrameAtHand& at_hand, bool counts);
  void ReadStatusWords(const track::LogicalAccess& access);
  /// Frames with outputs between the last one of the watch and the frame at hand.
  [[nodiscard]] std::uint64_t UnreturnedSince(SlaveId id, const OutputWatch& watch) const {
    return sent_frames_.UnreturnedBetween(watch.last_sent, sent_.number, bus_.network().fmmus(id));
  }
  [[nodiscard]] std::optional<DcTime> DcByStamps() const;
  void EndRun(SlaveId id);
  /// The rhythm of its outputs is evaluated now or not at all.
  [[nodiscard]] bool FramesMissing(SlaveId id, const OutputRate& rate, const CyclicImage& image,
                                   TimeNs configured) const;
  void EndRate(SlaveId id, OutputWatch& watch);
  void RenewRate(SlaveId id, Slave& slave);
  void PublishGap(SlaveId id, const OutputWatch& watch, const Interval& gap, const FrameRef& after);
  void StarvedUntil(SlaveId id, const FrameRef& fell, esc::AlWord to, std::optional<std::uint16_t> code);
  void Starve(SlaveId id, const FrameRef& until, OutputGap::End end);
  void OnMemoryWritten(const track::SlaveAccess& access);
  void OnFmmus(const track::SlaveAccess& access);
  void OnDcAccess(const track::SlaveAccess& access);
  void OnDelayAccess(const track::SlaveAccess& access);
  void SwitchedOn(SlaveId slave, const DcUnit& unit);

  const model::BusModel& bus_;
  EventSink& sink_;
  DcClock clock_;
  TimeTrust trust_;
  SentFrames sent_frames_;
  CyclicImages images_;
  CycleSummary earlier_;  // of the run before with the most cycles
  SlaveDelays delays_;
  std::vector<std::unique_ptr<Slave>> slaves_;  // grows without moving what rules refer to

  FrameRef sent_, returned_;
  FrameRef last_seen_;          // of the capture
  std::uint64_t last_key_ = 0;  // of that frame, where it was outbound
  std::optional<DcTime> frame_dc_;
  static constexpr std::size_t kPending = 16;
  FrameAtHand at_hand_;
  std::array<ProcessDatagram, kPending> pending_{};
  std::size_t pending_count_ = 0;
};

}  // namespace ecaudit::sync
