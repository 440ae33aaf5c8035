/// in: intervals between frames with outputs for one slave in OP.  out: their mean, pauses left out.
///
/// An interval of n cycles counts as n. Where jitter leaves open how many an interval is, it counts together with those
/// after it, until their sum is about a whole number: what is late now is early then.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/time_base.h"

namespace ecaudit::sync {

/// By no more than this part of a cycle two rhythms, or an interval and the cycle, are the same.
inline constexpr TimeNs kSameRhythm = 8;

/// Intervals of one cycle each, as nearly all are: what they come to is the same for all slaves with this cycle.
struct SteadyIntervals {
  TimeNs nominal = 0;
  TimeBase base = TimeBase::kNone;
  std::uint64_t count = 0;
  TimeNs ns = 0, off = 0, most_off = 0;  ///< the sum; from the cycle: all of them, and the one that is off most

  /// @return false: it is none of these
  [[nodiscard]] bool Add(const Interval& interval) {
    const TimeNs apart = std::abs(interval.ns - nominal);
    if (apart > nominal / kSameRhythm || interval.base != base) return false;
    ++count;
    ns += interval.ns;
    off += apart;
    most_off = std::max(most_off, apart);
    return true;
  }
};

class OutputRate {
 public:
  [[nodiscard]] std::uint64_t cycles() const { return sum_.cycles; }
  /// Meaningful when there are cycles.
  [[nodiscard]] double mean_ns() const { return static_cast<double>(sum_.ns) / static_cast<double>(sum_.cycles); }
  /// How wrong the mean may be for the frames' jitter, in parts of it: of the first and the last of them, and of those
  /// where the number of cycles stayed open.
  [[nodiscard]] double JitterShare() const;
  /// Length of all of them.
  [[nodiscard]] TimeNs ns() const { return sum_.ns; }
  /// Median of the intervals: where it keeps to a cycle, a mean that does not shows pauses.
  [[nodiscard]] TimeNs usual() const { return usual_; }
  [[nodiscard]] TimeBase base() const { return base_; }
  [[nodiscard]] const FrameRef& first() const { return first_; }
  [[nodiscard]] const FrameRef& last() const { return sum_.last; }

  /// What the intervals are counted by is as new as the image's median, and most of them are one cycle by it.
  [[nodiscard]] bool Follows(const CyclicImage& image) const {
    return nominal_ > 0 && image.nominal_of <= renewed_at_ && strange_ != kEnoughIntervals;
  }
  /// Takes the median of `image`, or the configured cycle where that is about it.
  /// @param configured cycle by the master's settings, 0 when not known
  /// @param frames_missing  between those that were added last others were sent: no other rhythm is to be concluded
  /// from them
  /// @return whether the frames came to another rhythm. Then this ends where they kept the old one for certain
  bool Renew(const CyclicImage& image, TimeNs configured, bool frames_missing);
  /// Renew() would report it if no frames were missing.
  [[nodiscard]] bool MayTurn(const CyclicImage& image, TimeNs configured) const {
    return LookAt(image, configured).turned;
  }
  /// The frame after which the intervals lie by which it would.
  [[nodiscard]] FrameNo turn_from() const { return strange_ > 0 ? turn_from_.number : firm_.last.number; }
  /// After that: the intervals after the place where it did are the first of the new one.
  /// @param last  where these end
  void GoOnFromTurn(const FrameRef& last);
  void Add(const Interval& interval, const FrameRef& from, const FrameRef& to) {
    SteadyIntervals one = Steady();
    if (IsSteady() && one.Add(interval)) {
      AddSteady(one, to);
    } else {
      AddInFull(interval, from, to);
    }
  }
  /// Intervals of a cycle can be added together: one came by the clock so far, and nothing is open.
  [[nodiscard]] bool IsSteady() const { return sum_.cycles != 0 && open_ == 0 && sum_.ns <= kFar; }
  /// None of them so far.
  [[nodiscard]] SteadyIntervals Steady() const { return {.nominal = nominal_, .base = base_}; }
  /// Add() of each of them. @param to  where the last one ends
  void AddSteady(const SteadyIntervals& steady, const FrameRef& to) {
    intervals_ += steady.count;
    seen_ += steady.count;
    off_ += steady.off;
    most_off_ = std::max(most_off_, steady.most_off);
    strange_ = 0;
    sum_.ns += steady.ns;
    sum_.cycles += steady.count;
    sum_.last = to;
  }
  /// Add() without the short way for what nearly all intervals are.
  void AddInFull(const Interval& interval, const FrameRef& from, const FrameRef& to);
  /// What follows has nothing to do with what was so far, but for the clock.
  void BeginAnew();

 private:
  /// Sums of intervals stay far below what fits.
  static constexpr TimeNs kFar = TimeNs{1} << 60U;

  struct Sum {
    std::uint64_t cycles = 0;
    std::uint64_t open = 0;     ///< times that jitter left their number open
    std::int64_t doubtful = 0;  ///< cycles more than frames, where jitter leaves open which is right
    std::int64_t left_out = 0;  ///< cycles without a frame in pauses of whole cycles
    TimeNs ns = 0;
    FrameRef last;
  };

  /// What the intervals come to now.
  struct Look {
    TimeNs measured = 0, next = 0;
    bool other = false, turned = false;
  };
  [[nodiscard]] Look LookAt(const CyclicImage& image, TimeNs configured) const;
  void BeginTurn(const FrameRef& from);
  [[nodiscard]] bool IsRhythm() const;
  [[nodiscard]] TimeNs OffOf(TimeNs interval) const;
  void Close(TimeNs since, const FrameRef& to);
  void Count(TimeNs since, TimeNs cycles, const FrameRef& to);

  TimeBase base_ = TimeBase::kNone;
  TimeNs nominal_ = 0, usual_ = 0, next_ = 0;  // next_: of the rhythm that Renew() found
  std::uint64_t renewed_at_ = 0;
  FrameRef first_;
  Sum sum_, firm_;  // firm_: when the rhythm was looked at last
  TimeNs open_ns_ = 0;
  TimeNs open_ = 0;      // intervals in open_ns_
  TimeNs off_ = 0;       // all intervals from whole cycles, ...
  TimeNs most_off_ = 0;  // ... and the one that was off most
  std::uint64_t intervals_ = 0;
  // The last intervals that were none of a cycle, and what was before: perhaps they are another rhythm.
  std::uint64_t strange_ = 0;
  TimeNs strange_ns_ = 0;
  TimeNs strange_least_ = 0, strange_most_ = 0;
  Sum turn_;
  FrameRef turn_from_;
  std::uint64_t seen_ = 0, seen_strange_ = 0;  // since the last look at the image's median
};

}  // namespace ecaudit::sync
