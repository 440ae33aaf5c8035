/// in: frames with outputs for one slave.  out: how they arrive.
///
/// keeps: the last frame and the slave's own measurements, its rate, its rhythm, and its phase to SYNC0.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>

#include "analyzers/model/logical_expectation.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/arrival_grid.h"
#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/output_rate.h"
#include "analyzers/sync/sync0_phase.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/time_base.h"
#include "decoder/base/bytes.h"

namespace ecaudit::sync {

class FedTogether;

struct OutputWatch {
  static constexpr TimeNs kUsualWatchdogNs = 100'000'000;  ///< after power-on

  bool seen = false;    ///< a frame with outputs for it was seen
  bool direct = false;  ///< the last one wrote them to the slave's memory, without FMMU
  FrameTime last;
  FrameNo last_sent = 0;
  bool in_op = false;        ///< when the last frame came
  FrameRef op_since;         ///< it is known to be in OP since this frame; not seen: it is not in OP
  bool may_be_hole = false;  ///< the capture may miss frames after the last one
  std::uint64_t frames_in_op = 0;
  const CyclicImage* image = nullptr;
  TimeNs watchdog_ns = kUsualWatchdogNs;  ///< as set; 0 is off
  // Left OP by itself since the last frame.
  FrameRef fell;
  esc::AlWord fell_to;
  std::optional<std::uint16_t> fell_code;
  // While in OP.
  OutputRate rate;
  ArrivalGrid grid;  ///< for families with a jitter limit and without SYNC0
  Sync0Phase phase;
  /// Of the last stay in SAFEOP with SYNC0; null: nothing was measured.
  std::unique_ptr<Sync0Phase> safeop_phase;
  bool in_safeop = false;           ///< when the last frame came, with SYNC0
  FedTogether* together = nullptr;  ///< has counted frames that are not added here so far; null: there are none
  /// Status word in the inputs of this frame and of the one before.
  std::optional<std::uint16_t> status_word, last_status_word;

  /// All frames so far are added, and each that follows is.
  void Part();
  /// The frame at hand brought outputs.
  void Add(const FrameTime& time, FrameNo sent, const CyclicImage* of, bool slave_in_op);
  /// It got the last outputs in OP, as far as is known.
  [[nodiscard]] bool FedInOp() const {
    return seen && (in_op || (op_since.seen() && last.frame.number >= op_since.number));
  }
  /// It is known to be in OP, and waits for outputs.
  [[nodiscard]] bool Waits() const { return op_since.seen() || FedInOp(); }
  /// Since when it does; unset when it is not known to be in OP.
  [[nodiscard]] std::optional<FrameTime> WaitsSince() const;
  /// Nearly always: the last two frames with the data of this image fed it. What lies between them is the same for all
  /// such slaves.
  [[nodiscard]] bool Follows(const CyclicImage* of) const {
    return of != nullptr && of == image && of->gap_from == last.frame.number;
  }
  /// How far the frame at hand lies after that. @param follows  it Follows() its image
  [[nodiscard]] Interval GapTo(const FrameTime& time, bool follows) const {
    return follows && FedInOp() ? image->gap : GapByClocks(time);
  }
  /// The same by the clock that measures the rhythm of its outputs; kNone: that clock does not show it.
  [[nodiscard]] Interval RhythmTo(const FrameTime& time, bool follows) const {
    if (follows) return image->rhythm;
    return image != nullptr ? BetweenBy(image->rhythm_base(), last, time) : Interval{};
  }
  /// From which length on a gap is reported, ns; 0: none is.
  [[nodiscard]] TimeNs GapLimit(const CyclicImage* of) const {
    const bool known = of != nullptr && of->has_nominal();
    const TimeNs by_cycle = known ? of->nominal_ns + of->nominal_ns / 2 : 0;
    if (watchdog_ns == 0) return by_cycle;
    return by_cycle > 0 ? std::min(by_cycle, watchdog_ns / 2) : watchdog_ns / 2;
  }
  /// Of this gap, as far as the watch knows it.
  [[nodiscard]] OutputGap Describe(SlaveId slave, const Interval& gap) const;
  /// The slave is set up again.
  void BeginAnew();
  /// The slave is to leave OP, or has left it, as the master asked.
  void LeaveOp();
  /// The slave was seen to have left OP by itself.
  void Fell(const FrameRef& frame, esc::AlWord to, std::optional<std::uint16_t> code);
  /// The capture misses frames, or may do so.
  void OnHole(const track::CaptureGap& gap);
  /// @param data of a logical datagram to which the slave gave `share`
  void ReadStatusWord(const model::SlaveModel& slave, const model::LogicalShare& share, ByteSpan data) {
    if (layout_version_ != slave.process.version()) FindStatusWord(slave);
    status_word.reset();
    if (!status_at_ || *status_at_ + 2 > share.input_bytes) return;
    const std::size_t at = std::size_t{share.input_offset} + *status_at_;
    if (at + 2 <= data.size()) status_word = LoadLittleEndian<std::uint16_t>(data.data() + at);
  }

 private:
  void FindStatusWord(const model::SlaveModel& slave);
  [[nodiscard]] Interval GapByClocks(const FrameTime& time) const;

  std::uint64_t layout_version_ = ~std::uint64_t{0};
  std::optional<std::uint32_t> status_at_;  // first byte in the inputs
};

}  // namespace ecaudit::sync
