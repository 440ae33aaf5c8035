/// The clock of one pcapng interface: from the ticks in its packets to nanoseconds since 1970, exactly.
///
/// Source: draft-ietf-opsawg-pcapng, Interface Description Block, options if_tsresol and if_tsoffset.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/base/wide_integers.h"

namespace ecaudit::capture {

class TimeScale {
 public:
  /// Microseconds since 1970: what holds without options.
  TimeScale() = default;
  /// @param tsresol   bits 6-0 n: ticks of 10^-n s, or of 2^-n s when bit 7 is set
  /// @param offset_s  seconds added to every time stamp
  TimeScale(std::uint8_t tsresol, std::int64_t offset_s) : offset_s_(offset_s) {
    const unsigned exponent = tsresol & 0x7FU;
    if ((tsresol & 0x80U) != 0) {
      multiplier_ = kNsPerSecond;
      shift_ = exponent;
      return;
    }
    multiplier_ = 1;
    for (unsigned n = exponent; n < 9; ++n) multiplier_ *= 10;
    // 10^20 and more attoseconds-of-attoseconds to the nanosecond: no 64-bit count of them reaches one.
    if (exponent > 28) multiplier_ = 0;
    for (unsigned n = 9; n < exponent && n < 28; ++n) divisor_ *= 10;
  }

  /// Rounds down where the ticks are finer than a nanosecond.
  /// @return empty when the time lies outside of what TimeNs holds (the years 1677 to 2262)
  [[nodiscard]] std::optional<TimeNs> ToNs(std::uint64_t ticks) const {
    std::int64_t plain = 0;  // micro- and nanoseconds since 1970, as nearly all files have them
    const bool whole = shift_ == 0 && divisor_ == 1 && offset_s_ == 0;
    if (whole && !__builtin_mul_overflow(ticks, multiplier_, &plain)) return plain;
    Unsigned128 ns = (static_cast<Unsigned128>(ticks) * multiplier_) >> shift_;  // below 2^94: cannot overflow
    if (divisor_ != 1) ns /= divisor_;
    const Signed128 time = static_cast<Signed128>(ns) + static_cast<Signed128>(offset_s_) * kNsPerSecond;
    if (time > std::numeric_limits<TimeNs>::max() || time < std::numeric_limits<TimeNs>::min()) return std::nullopt;
    return static_cast<TimeNs>(time);
  }

  /// One tick in nanoseconds, rounded up; 1 where it is finer.
  [[nodiscard]] std::int64_t resolution_ns() const {
    if (divisor_ != 1 || multiplier_ == 0) return 1;
    const Unsigned128 one = static_cast<Unsigned128>(1) << shift_;
    const auto ns = static_cast<std::int64_t>((multiplier_ + one - 1) >> shift_);
    return ns > 0 ? ns : 1;
  }

 private:
  static constexpr std::uint64_t kNsPerSecond = 1'000'000'000;

  std::uint64_t multiplier_ = 1000;
  std::uint64_t divisor_ = 1;
  unsigned shift_ = 0;
  std::int64_t offset_s_ = 0;
};

}  // namespace ecaudit::capture
