/// in: frames with outputs for one slave, by the DC clock.  out: where each lies between two pulses of SYNC0.
///
/// keeps: the statistics of all of them, the pulses that the last one came after, and by how many the pulses can be
/// ahead of the frames if each had one so far.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "analyzers/result/dc_summary.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/time_base.h"
#include "decoder/base/wide_integers.h"

namespace ecaudit::sync {

/// Frames with outputs that came after one pulse of SYNC0 each, every one after the next. How far they lie from the
/// place between two pulses where the frame before them was is the same at all slaves that they feed.
struct PhaseRun {
  /// One that is earlier, or later, than those before it.
  struct End {
    std::int64_t shift_ns = 0;
    FrameRef frame;
  };
  std::int64_t cycle_ns = 0;
  std::span<const std::int32_t> shifts_ns;  ///< of each frame
  std::int64_t sum = 0;                     ///< of these
  std::int64_t squares = 0;                 ///< of their squares
  End least, most;
  FrameRef last;
};

class Sync0Phase {
 public:
  struct Arrival {
    bool measured = false;
    TimeNs phase_ns = 0;      ///< since the SYNC0 before it
    bool doubled = false;     ///< two frames came after the same pulse
    std::uint64_t empty = 0;  ///< pulses without a frame
    /// Seen: it is certain only of all frames after this one, `frames` of them, that crept over a pulse. Else these
    /// are the one before and this one.
    FrameRef since;
    std::uint64_t frames = 0;
    [[nodiscard]] bool missed() const { return doubled || empty > 0; }
  };

  /// SYNC0 is on, and its pulses can be counted.
  [[nodiscard]] static bool Counts(const DcUnit& unit) {
    const std::optional<SyncSettings>& settings = unit.active();
    return settings && settings->activation.sync0() && settings->start_ns && settings->sync0_cycle_ns &&
           *settings->sync0_cycle_ns > 0 && settings->sync0_cycle_ns < 0x80000000U &&
           !unit.activation()->auto_activation();
  }
  /// @param unit    one that Counts()
  /// @param now     system time of the reference clock in the frame
  /// @param wide    that clock has 64 bit
  /// Where only low halves count, the start is found by the stamps: without them nothing is measured.
  /// @param way_ns  how much later the last byte reaches the slave
  /// @param doubt_ns  how wrong `now` may be besides, mostly: stamps know no bound; 0: the frame itself carried it
  Arrival Add(const DcUnit& unit, const FrameRef& frame, const DcTime& now, bool wide, std::int64_t way_ns,
              TimeNs doubt_ns = 0);
  /// The frame at hand was the last one here, and nothing is conspicuous in it or reported of what comes after it as
  /// far as MayShift() allows.
  [[nodiscard]] bool IsCalm(const DcUnit& unit, const FrameRef& frame) const {
    return has_slot_ && !begins_anew_ && unit.active() && settings_frame_.number == unit.active()->frame.number &&
           last_frame_ == frame.number && last_pulse_ >= 0 && slot_.least == pulses_ && slot_.most == pulses_;
  }
  /// By how much earlier or later than the last frame the next ones may lie in their cycles, so that it is sure which
  /// pulse each came after: least and most, both included.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> MayShift(std::int64_t cycle) const {
    const std::int64_t phase = since_ - last_pulse_;
    return {uncertainty_ - phase, cycle - uncertainty_ - 1 - phase};
  }
  /// Add() of each frame of a run that MayShift() allows, after a frame that IsCalm().
  void AddRun(const PhaseRun& run);
  /// The next frame is not compared with the last one.
  void End() { has_slot_ = false; }
  /// What comes next is measured for itself; until then what was measured last counts.
  void BeginAnew() {
    End();
    begins_anew_ = true;
  }

  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  /// How far after a pulse the frames arrived so far, on average: just before one and just after it is at it, not in
  /// the middle.
  [[nodiscard]] TimeNs UsualNs(TimeNs cycle) const;
  /// How well the slave's clock is known to agree with the reference, ns.
  [[nodiscard]] TimeNs uncertainty_ns() const { return uncertainty_; }
  /// Frames so near to a pulse that the side is unknown, and the first of them.
  [[nodiscard]] std::uint64_t undecided() const { return undecided_; }
  [[nodiscard]] const FrameRef& first_undecided() const { return first_undecided_; }
  /// Intervals without a frame or with two were found.
  [[nodiscard]] bool missed() const { return empty_ + doubled_ > 0; }
  /// Meaningful when there were frames.
  [[nodiscard]] SyncPhase Summary(std::uint32_t cycle_ns) const;

 private:
  /// How many pulses were before a frame.
  struct Slot {
    std::int64_t least = 0, most = 0;
  };
  /// By how many they are ahead of the frames, and the frame that shows it.
  struct Lead {
    std::int64_t pulses = 0;
    std::uint64_t frames = 0;
    FrameRef frame;
  };

  [[gnu::cold]] void ForgetStatistics(TimeNs origin);
  void Follow(const SyncSettings& settings, const FrameRef& frame, const DcTime& now, bool wide);
  [[nodiscard]] static std::optional<std::uint64_t> StartOf(const SyncSettings& settings, const FrameRef& frame,
                                                            const DcTime& now, bool wide);
  void Count(const FrameRef& frame, TimeNs phase, std::int64_t cycle);
  void CountRun(const PhaseRun& run, TimeNs phase);
  /// From the first frame, the shorter way round.
  [[nodiscard]] TimeNs Apart(TimeNs phase, std::int64_t cycle) const {
    TimeNs apart = phase - origin_;
    if (2 * apart > cycle) apart -= cycle;
    if (2 * apart < -cycle) apart += cycle;
    return apart;
  }
  [[nodiscard]] std::size_t BinOf(TimeNs phase, std::int64_t cycle) const;
  [[nodiscard]] std::int64_t PulsesBefore(std::int64_t since, std::int64_t cycle);
  static Slot SlotOf(std::int64_t since, std::int64_t pulses, std::int64_t cycle, TimeNs uncertainty);
  void Place(Arrival& arrival, const Slot& slot);
  void Carry(Arrival& arrival, const FrameRef& frame, const Slot& slot, bool follows);

  FrameRef settings_frame_;
  std::uint32_t epoch_ = 0;
  std::uint64_t start_ns_ = 0;                 // by the clock, where that is known
  std::int64_t pulses_ = 0, last_pulse_ = -1;  // before the last frame, and when; -1: unknown
  FrameNo last_frame_ = 0;
  bool has_slot_ = false;
  bool begins_anew_ = true;
  bool has_start_ = false;
  Slot slot_;               // of the last frame
  std::int64_t since_ = 0;  // the first pulse, at the last frame
  Lead least_, most_;       // with one pulse for each frame since a frame that did not follow on another
  std::uint64_t frames_ = 0, empty_ = 0, doubled_ = 0, undecided_ = 0;
  FrameRef first_undecided_;
  TimeNs origin_ = 0;      // phase of the first frame, from which the others are measured ...
  Signed128 sum_ = 0;      // ... the shorter way round: the sum of that, and ...
  Signed128 squares_ = 0;  // ... of its squares
  TimeNs min_ = 0, max_ = 0, margin_ = 0, uncertainty_ = 0;
  FrameRef margin_frame_;
  std::array<std::uint64_t, 50> bins_{};
};

}  // namespace ecaudit::sync
