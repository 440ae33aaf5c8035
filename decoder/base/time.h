/// Points in time come from untrusted files and may be anything that 64 bit hold.
#pragma once

#include <cstdint>
#include <limits>

#include "decoder/base/ids.h"

namespace ecaudit {

/// Nanoseconds from `from` to `to`, negative when `to` is earlier; the nearest limit where it does not fit.
[[nodiscard]] inline std::int64_t Elapsed(TimeNs from, TimeNs to) {
  std::int64_t difference = 0;
  if (!__builtin_sub_overflow(to, from, &difference)) return difference;
  return to < from ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
}

/// That time after, or before where it is negative; the nearest limit where it does not fit.
[[nodiscard]] inline TimeNs Later(TimeNs time, std::int64_t by) {
  TimeNs sum = 0;
  if (!__builtin_add_overflow(time, by, &sum)) return sum;
  return by < 0 ? std::numeric_limits<TimeNs>::min() : std::numeric_limits<TimeNs>::max();
}

/// Clocks of captures go back a little where packets are not written in order, and stand still where nothing is sent.
/// What is more than that is another recording, or a clock that was set.
inline constexpr std::int64_t kClockJumpBackNs = 1'000'000'000;
inline constexpr std::int64_t kClockJumpAheadNs = 3'600'000'000'000;
[[nodiscard]] inline bool ClockJumps(TimeNs from, TimeNs to) {
  const std::int64_t apart = Elapsed(from, to);
  return apart < -kClockJumpBackNs || apart > kClockJumpAheadNs;
}

/// A master that waits for something looks for it more often than this.
inline constexpr std::int64_t kLongestLookNs = 60'000'000'000;
/// The start of a wait by the clock as it is now: if the clock was set between two looks, that time does not count.
inline void FollowClock(FrameRef& since, const FrameRef& look, const FrameRef& next) {
  if (!since.has_time || !look.has_time || !next.has_time) return;
  const std::int64_t apart = Elapsed(look.time, next.time);
  if (apart >= -kClockJumpBackNs && apart <= kLongestLookNs) return;
  since.time = Later(since.time, apart);
}

}  // namespace ecaudit
