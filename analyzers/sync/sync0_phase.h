/// in: frames with outputs for one slave, by the DC clock.  out: where each lies between two pulses of SYNC0.
///
/// keeps: the statistics of all of them, the pulses that the last one came after, and by how many the pulses can be
/// ahead of the frames if each had one so far.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "analyzers/result/dc_summary.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/time_base.h"
#include "decoder/base/wide_integers.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::sync {

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

  /// @param unit    one whose pulses can be counted
  /// @param now     system time of the reference clock in the frame
  /// @param wide    that clock has 64 bit
  /// Where only low halves count, the start is found by the stamps: without them nothing is measured.
  /// @param way_ns  how much later the last byte reaches the slave
  /// @param doubt_ns  how wrong `now` may be besides, mostly: stamps know no bound; 0: the frame itself carried it
  Arrival Add(const DcUnit& unit, const FrameRef& frame, const DcTime& now, bool wide, std::int64_t way_ns,
              TimeNs doubt_ns = 0);
  /// The last frame had the time `now`, came after the next pulse, and so did those before it. While each of those that
  /// follow comes well between the next two, CountSteady() for each of them, and GoOn() once, are the same as Add().
  [[nodiscard]] bool IsSteady(const DcUnit& unit, const DcTime& now) const {
    const std::int64_t lead = pulses_ - static_cast<std::int64_t>(frames_);
    return has_slot_ && !begins_anew_ && settings_frame_.number == unit.active()->frame.number && epoch_ == now.epoch &&
           last_pulse_ >= 0 && since_ <= kNever / 2 && slot_.least == pulses_ && slot_.most == pulses_ &&
           lead == least_.pulses && lead == most_.pulses;
  }
  void CountSteady(const FrameRef& frame, TimeNs phase, std::int64_t cycle) {
    if (phase < min_ || phase > max_) Extend(frame, phase, cycle);
    const TimeNs apart = Apart(phase, cycle);
    sum_ += apart;
    squares_ += Signed128{apart} * apart;
    ++bins_[BinOf(phase, cycle)];
  }
  /// @param last  of `count` frames; it came `phase` after its pulse
  void GoOn(const FrameRef& last, std::uint64_t count, TimeNs phase, std::int64_t cycle) {
    const auto pulses = static_cast<std::int64_t>(count);
    frames_ += count;
    pulses_ += pulses;
    last_pulse_ += pulses * cycle;
    since_ = last_pulse_ + phase;
    slot_ = {pulses_, pulses_};
    least_ = most_ = {pulses_ - static_cast<std::int64_t>(frames_), frames_, last};
  }
  /// How far the last frame came after its pulse.
  [[nodiscard]] TimeNs last_ns() const { return since_ - last_pulse_; }
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
  /// How well the slave's clock agrees with the reference, ns.
  [[nodiscard]] static TimeNs UncertaintyOf(const DcUnit& unit) {
    return std::max<TimeNs>(kClocksAgree, unit.last_difference_ns().value_or(0));
  }
  /// The same at the last frame, by what is known of it.
  [[nodiscard]] TimeNs uncertainty_ns() const { return uncertainty_; }
  /// Frames so near to a pulse that the side is unknown, and the first of them.
  [[nodiscard]] std::uint64_t undecided() const { return undecided_; }
  [[nodiscard]] const FrameRef& first_undecided() const { return first_undecided_; }
  /// Of the frames that frames() counts.
  struct Misses {
    std::uint64_t empty = 0, doubled = 0;  ///< intervals without a frame, with two
    std::uint64_t longest = 0;             ///< without a frame, one after the other
    std::uint64_t undecided = 0;           ///< frames so near to a pulse that the side is unknown
  };
  [[nodiscard]] const Misses& misses() const { return misses_; }
  /// Intervals without a frame or with two were found.
  [[nodiscard]] bool missed() const { return empty_ + doubled_ > 0; }
  /// Meaningful when there were frames.
  [[nodiscard]] SyncPhase Summary(std::uint32_t cycle_ns) const;

 private:
  /// How well the slaves' clocks agree with the reference if nothing better is known: what counts as synchronised.
  static constexpr TimeNs kClocksAgree = 1000;
  static constexpr std::int64_t kNever = std::int64_t{1} << 62U;
  static constexpr std::size_t kBins = 50;

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

  /// @param phase of the first frame
  [[gnu::cold, gnu::noinline]] void BeginStatistics(TimeNs phase, std::int64_t cycle);
  void Follow(const SyncSettings& settings, const FrameRef& frame, const DcTime& now, bool wide);
  [[nodiscard]] static std::optional<std::uint64_t> StartOf(const SyncSettings& settings, const FrameRef& frame,
                                                            const DcTime& now, bool wide);
  /// Clocks come from the capture and may hold anything: unsigned numbers wrap where signed ones must not.
  [[nodiscard]] std::int64_t Since(const DcTime& now, std::int64_t way_ns) const {
    return static_cast<std::int64_t>(
        WrappingDifference(WrappingSum(now.ns, static_cast<std::uint64_t>(way_ns)), start_ns_));
  }
  void Count(const FrameRef& frame, TimeNs phase, std::int64_t cycle) {
    if (begins_anew_) BeginStatistics(phase, cycle);
    ++frames_;
    CountSteady(frame, phase, cycle);
  }
  /// No phase so far was as early, or as late.
  [[gnu::noinline]] void Extend(const FrameRef& frame, TimeNs phase, std::int64_t cycle);
  void CountMisses(const Arrival& arrival, bool undecided);
  /// From the first frame, the shorter way round.
  [[nodiscard]] TimeNs Apart(TimeNs phase, std::int64_t cycle) const {
    TimeNs apart = phase - origin_;
    if (2 * apart > cycle) apart -= cycle;
    if (2 * apart < -cycle) apart += cycle;
    return apart;
  }
  [[nodiscard]] static std::size_t BinOf(TimeNs phase, std::int64_t cycle) {
    // Divisions of 32 bit are several times as fast.
    const auto scaled = static_cast<std::uint64_t>(phase) * kBins;
    const std::uint64_t bin = scaled <= UINT32_MAX
                                  ? static_cast<std::uint32_t>(scaled) / static_cast<std::uint32_t>(cycle)
                                  : scaled / static_cast<std::uint64_t>(cycle);
    return std::min<std::uint64_t>(bin, kBins - 1);
  }
  [[nodiscard]] std::int64_t PulsesBefore(std::int64_t since, std::int64_t cycle);
  static Slot SlotOf(std::int64_t since, std::int64_t pulses, std::int64_t cycle, TimeNs uncertainty);
  void Place(Arrival& arrival, const Slot& slot);
  void Carry(Arrival& arrival, const FrameRef& frame, const Slot& slot, bool follows);

  FrameRef settings_frame_;
  std::uint32_t epoch_ = 0;
  std::uint64_t start_ns_ = 0;                 // by the clock, where that is known
  std::int64_t pulses_ = 0, last_pulse_ = -1;  // before the last frame, and when; -1: unknown
  bool has_slot_ = false;
  bool begins_anew_ = true;
  bool has_start_ = false;
  Slot slot_;               // of the last frame
  std::int64_t since_ = 0;  // the first pulse, at the last frame
  Lead least_, most_;       // with one pulse for each frame since a frame that did not follow on another
  std::uint64_t frames_ = 0, empty_ = 0, doubled_ = 0, undecided_ = 0;
  FrameRef first_undecided_;
  Misses misses_;
  TimeNs origin_ = 0;      // phase of the first frame, from which the others are measured ...
  Signed128 sum_ = 0;      // ... the shorter way round: the sum of that, and ...
  Signed128 squares_ = 0;  // ... of its squares
  TimeNs min_ = 0, max_ = 0, margin_ = 0, uncertainty_ = 0;
  FrameRef margin_frame_;
  std::array<std::uint64_t, kBins> bins_{};
};

}  // namespace ecaudit::sync
