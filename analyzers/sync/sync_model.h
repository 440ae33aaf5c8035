/// in: decoder events.  out: SyncSwitchedOn, OutputGap, SyncSlotMiss, ArrivalOff, PllMeasured; figures of cycle and
/// clocks when the capture ends.
///
/// keeps: nothing itself, but
///
///   CyclicImages  rhythm of the process data       DcUnit, DcClock  distributed clocks
///   OutputWatch   how outputs reach one slave      PllWatch         what the drive shows of its own clock
///   OutputMeter   ... and how they should          TimeTrust        how good the stamps are
///   FedTogether   what slaves of one image share
///   SentFrames    frames as they passed            FrameAtHand      the one that passes now
///   ProcessDataPauses   when no slave got outputs
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/result/cycle_summary.h"
#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/dc_clock.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/fed_together.h"
#include "analyzers/sync/frame_at_hand.h"
#include "analyzers/sync/output_meter.h"
#include "analyzers/sync/output_watch.h"
#include "analyzers/sync/pll_watch.h"
#include "analyzers/sync/process_data_pauses.h"
#include "analyzers/sync/sent_frames.h"
#include "analyzers/sync/slave_delays.h"
#include "analyzers/sync/time_base.h"
#include "analyzers/sync/time_trust.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/pipeline.h"

namespace ecaudit::sync {

/// Process data of `image` came `interval` after the last ones, by its rhythm_base().
struct IntervalMeasured {
  const CyclicImage& image;
  FrameRef frame;
  TimeNs interval = 0;
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

  /// Of all outputs on the bus.
  [[nodiscard]] const ProcessDataPauses& pauses() const { return pauses_; }
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
  struct Slave {
    DcUnit dc;
    OutputWatch outputs;
    PllWatch pll;
    // As they were after the last access to them:
    bool fmmus_known = false;
    bool outputs_mapped = false;
  };
  /// Of a slave of which something is to be changed, or read: outputs that come are its own from here on.
  Slave& Of(SlaveId id);
  Slave& Grow(SlaveId slave) { return slave < slaves_.size() ? *slaves_[slave] : Add(slave); }
  Slave& Add(SlaveId slave);
  [[nodiscard]] bool IsCopyOfLast(const wire::FrameView& frame) const;
  void BeginFrame(const FrameRef& sent, const FrameRef& returned);
  void Flush();
  [[nodiscard]] bool IsOfOp(const model::LogicalExpectation& expected) const;
  const CyclicImage* Measure(const ProcessDatagram& datagram, bool in_op);
  void FeedEach();
  void FeedAll(const ProcessDatagram& datagram, const model::LogicalExpectation& expected, const CyclicImage* image);
  void ReadStatusWords(const track::LogicalAccess& access);
  void EndRun(SlaveId id);
  void OnMemoryWritten(const track::SlaveAccess& access);
  void OnFmmus(const track::SlaveAccess& access);
  void OnDcAccess(const track::SlaveAccess& access);
  void OnDelayAccess(const track::SlaveAccess& access);
  void SwitchedOn(SlaveId slave, DcUnit& unit);

  const model::BusModel& bus_;
  EventSink& sink_;
  DcClock clock_;
  TimeTrust trust_;
  ProcessDataPauses pauses_;
  SentFrames sent_frames_;
  CyclicImages images_;
  CycleSummary earlier_;  // of the run before with the most cycles
  SlaveDelays delays_;
  std::vector<std::unique_ptr<Slave>> slaves_;  // grows without moving what rules refer to
  /// Slaves that the datagrams of one image feed.
  struct Feeds {
    FedTogether together;         // nearly always all of them ...
    std::vector<SlaveId> others;  // ... but for these
    std::uint64_t mappings = 0;   // the network's version of what is mapped, and ...
    std::uint16_t length = 0;     // ... the length of the datagrams for which that is so
  };
  std::array<Feeds, CyclicImages::kMost> feeds_;

  OutputMeter meter_;
  FrameAtHand at_hand_;
  FrameRef last_seen_;          // of the capture
  std::uint64_t last_key_ = 0;  // of that frame, where it was outbound
};

}  // namespace ecaudit::sync
