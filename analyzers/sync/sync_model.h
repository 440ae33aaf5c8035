/// in: decoder events.  out: SyncSwitchedOn, OutputGap, SyncSlotMiss; figures of cycle and clocks when the capture
/// ends.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/sync/dc_clock.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/interval_statistics.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/time_base.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/pipeline.h"

namespace ecaudit::sync {

/// The family's limit for a cycle that was measured: a cycle of 999.9 us counts as one of 1 ms. Null when there is
/// none.
[[nodiscard]] const device::JitterLimit* LimitFor(const device::SyncDescription& family, TimeNs cycle);

/// The cyclic process data of one logical address, and their rhythm by every clock.
struct CyclicImage {
  bool used = false;
  wire::Command command = wire::Command::NOP;
  std::uint32_t address = 0;
  FrameTime last;
  bool last_was_sent = false;  ///< its outbound copy is in the capture: the time is that of its sending
  FrameNo gap_from = 0;        ///< last frame but one ...
  Interval gap;                ///< ... and how far it lies before the last, for all slaves that both of them fed
  IntervalStatistics by_dc, by_esl, by_stamp;
  TimeNs nominal_ns = 0;  ///< median of the best clock, renewed now and then
  std::uint64_t nominal_of = 0;

  static constexpr std::size_t kSent = 16;
  std::array<FrameNo, kSent> sent{};  ///< outbound frames with these data, the newest at sent_count - 1
  std::uint64_t sent_count = 0;

  [[nodiscard]] std::pair<const IntervalStatistics*, TimeBase> Best() const;
  /// True when `frame` is the next that was sent behind `last`; frames that did not come back, or in another order,
  /// would else count as cycles without data.
  [[nodiscard]] bool SentNext(FrameNo frame) const;
};

/// How the outputs of one slave arrive.
struct OutputWatch {
  bool seen = false;  ///< a frame with outputs for it was seen
  FrameTime last;
  FrameNo last_sent = 0;
  bool in_op = false;        ///< when the last frame came
  bool may_be_hole = false;  ///< the capture may miss frames behind the last one
  std::uint64_t frames_in_op = 0;
  const CyclicImage* image = nullptr;
  TimeNs watchdog_ns = 100'000'000;  ///< as set, else as after power-on; 0 is off
  // Left OP by itself since the last frame.
  FrameRef fell;
  esc::AlWord fell_to;
  std::optional<std::uint16_t> fell_code;
  // Against SYNC0.
  FrameRef settings_frame;
  std::uint32_t epoch = 0;
  std::int64_t start_ns = 0;
  bool has_slot = false;
  std::int64_t slot_least = 0, slot_most = 0;
  std::uint64_t phases = 0, empty = 0, doubled = 0;
  double phase_mean = 0, phase_squares = 0;
  TimeNs phase_min = 0, phase_max = 0, margin = 0, uncertainty = 0;
  FrameRef margin_frame;
  std::array<std::uint64_t, 50> phase_bins{};
  // Rate while in OP: cycles and their length, pauses left out.
  std::uint64_t rate_cycles = 0;
  TimeNs rate_ns = 0;
  TimeBase rate_base = TimeBase::kNone;
  FrameRef rate_first, rate_last;
  // Against the cycles so far, for families with a jitter limit and without SYNC0.
  std::uint64_t grid_cycles = 0;
  TimeBase grid_base = TimeBase::kNone;
  double grid_ns = 0;         ///< length of grid_cycles cycles
  double grid_deviation = 0;  ///< of the last frame, ns
  // Status word in the inputs of the last frame.
  std::optional<std::uint16_t> status_word, last_status_word;  // of this frame and of the one before
  std::uint64_t layout_version = ~std::uint64_t{0};
  std::optional<std::uint32_t> status_at;  ///< first byte in the inputs
};

/// Process data of `image` came `interval` behind the last ones, by the best clock that both frames have.
struct IntervalMeasured {
  const CyclicImage& image;
  FrameRef frame;
  TimeNs interval = 0;
};

/// A frame with process data for a slave in OP ended `phase` behind SYNC0.
struct PhaseMeasured {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  TimeNs phase = 0;
};

class SyncModel final {
 public:
  static constexpr std::size_t kImages = 32;  ///< logical addresses that are measured; later ones are not

  /// @param bus  whence events come and where what is concluded goes
  /// All arguments must outlive the model. Made before everybody else who listens: rules that hear of process data find
  /// them measured.
  SyncModel(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus);

  void On(const FrameSeen& seen);
  void On(const track::LogicalAccess& access);
  void On(const track::Answered& answer);
  void On(const track::CaptureHole& hole);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const track::SlaveAccess& access);
  void On(const model::AlChangedByItself& change);
  void On(const model::AlErrorCode& code);
  /// The capture has ended.
  void Finish();

  [[nodiscard]] const DcUnit& dc(SlaveId slave) const;
  [[nodiscard]] const OutputWatch& outputs(SlaveId slave) const;
  [[nodiscard]] const DcClock& clock() const { return clock_; }
  /// The image that was exchanged most often; null when none was exchanged twice.
  [[nodiscard]] const CyclicImage* cycle() const;
  /// How wrong an interval by this clock may be, ns; unset when the clock cannot be trusted at all.
  [[nodiscard]] std::optional<TimeNs> Uncertainty(TimeBase base) const;

  [[nodiscard]] CycleSummary SummariseCycle() const;
  [[nodiscard]] BusDcSummary SummariseBus() const;
  /// Unset when nothing was seen of the slave's unit.
  [[nodiscard]] std::optional<DcSummary> Summarise(SlaveId slave) const;

 private:
  struct Slave {
    DcUnit dc;
    OutputWatch outputs;
    std::uint64_t pll_reads = 0, pll_outside = 0;  // of SYNCACT
    std::uint32_t delay_ns = 0;                    ///< register 0x0928 ...
    std::uint64_t delay_version = 0;               ///< ... at this version of the delays
  };
  /// What is known of a frame from its bytes.
  struct FrameFacts {
    FrameNo number = 0;
    std::uint32_t bytes = 0;
    std::optional<TimeNs> esl;
  };
  /// The frame at hand, once for all slaves.
  struct FrameAtHand {
    FrameTime time;
    std::int64_t length_ns = 0;           ///< on the wire; 0 when not known
    std::int64_t reference_delay_ns = 0;  ///< delay register of the reference clock
  };
  /// A logical datagram of the frame at hand; its time may come with a later datagram.
  struct Pending {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::uint16_t wkc = 0;
    bool assumed = false;
  };

  Slave& Of(SlaveId slave) { return slave < slaves_.size() ? *slaves_[slave] : Grow(slave); }
  Slave& Grow(SlaveId slave);
  [[nodiscard]] std::optional<PllSummary> SummarisePll(SlaveId id) const;
  void BeginFrame(const FrameRef& sent, const FrameRef& returned);
  void Flush();
  [[nodiscard]] std::optional<FrameAtHand> LookAtFrame();
  /// Of these process data, made when there is room for them; else null.
  CyclicImage* Find(wire::Command command, std::uint32_t address);
  const CyclicImage* Measure(const Pending& pending, const FrameTime& time);
  void Feed(SlaveId id, const FrameAtHand& at_hand, const CyclicImage* image);
  [[nodiscard]] std::int64_t DelayOf(SlaveId id) {
    if (id == kNoSlave) return 0;
    Slave& slave = Of(id);
    // The network's version changes when a slave may be another one, or comes back after a power cycle.
    const std::uint64_t version = delay_version_ + bus_.network().mapping_version();
    return slave.delay_version == version ? slave.delay_ns : ReadDelay(id, version);
  }
  std::int64_t ReadDelay(SlaveId id, std::uint64_t version);
  void MeasureArrival(SlaveId id, OutputWatch& watch, const FrameTime& time, const Interval& interval);
  void ReadStatusWords(const track::LogicalAccess& access);
  void MeasurePhase(SlaveId id, Slave& slave, const FrameAtHand& at_hand);
  /// @param configured cycle by the master's settings, 0 when not known
  static void MeasureRate(OutputWatch& watch, const Interval& interval, const FrameRef& frame, TimeNs configured);
  [[nodiscard]] const FrameFacts* FactsOf(FrameNo number) const;
  [[nodiscard]] std::uint64_t UnreturnedBetween(FrameNo before, FrameNo after) const;
  [[nodiscard]] OutputGap GapOf(SlaveId id, const OutputWatch& watch, const Interval& gap) const;
  void SwitchedOn(SlaveId slave, const DcUnit& unit);

  const model::BusModel& bus_;
  const Pipeline& pipeline_;
  EventSink& sink_;
  DcClock clock_;
  std::vector<std::unique_ptr<Slave>> slaves_;  // grows without moving what rules refer to
  std::uint64_t delay_version_ = 1;             // changes with every access to a delay register
  std::array<CyclicImage, kImages> images_;
  IntervalStatistics round_trips_;

  FrameRef sent_, returned_;
  std::optional<DcTime> frame_dc_;
  static constexpr std::size_t kPending = 16;
  std::array<Pending, kPending> pending_{};
  std::size_t pending_count_ = 0;

  static constexpr std::size_t kFacts = 1024;
  std::array<FrameFacts, kFacts> facts_{};
  static constexpr std::size_t kSentRing = 256;
  std::array<FrameNo, kSentRing> process_sent_{};  // outbound frames with process data, newest at process_count_ - 1
  std::uint64_t process_count_ = 0;
};

}  // namespace ecaudit::sync
