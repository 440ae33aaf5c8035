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

}  // namespace ecaudit
