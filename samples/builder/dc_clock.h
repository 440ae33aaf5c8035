/// The distributed clock of one slave: an oscillator with its own deviation, and the loop that follows the reference.
#pragma once

#include <algorithm>
#include <cstdint>

#include "decoder/base/ids.h"

namespace ecaudit::samples {

class DcClock {
 public:
  /// @param ppb           deviation of the oscillator, parts in 10^9
  /// @param at_power_on   local time at `power_on`, ns
  DcClock(std::int64_t ppb, std::uint64_t at_power_on, TimeNs power_on)
      : ppb_(ppb), start_(static_cast<std::int64_t>(at_power_on)), power_on_(power_on) {}

  /// Time of the oscillator, ns, as the receive time registers latch it.
  [[nodiscard]] std::int64_t Local(TimeNs now) const {
    const std::int64_t passed = now - power_on_;
    return start_ + passed + passed / 1'000'000 * ppb_ / 1000;
  }
  /// Local time plus the offset of 0x0920 and what the loop has corrected so far.
  [[nodiscard]] std::int64_t SystemTime(TimeNs now, std::int64_t offset) const { return Local(now) + offset + steer_; }

  /// The master wrote 0x0910: compares the low 32 bits with `own` (system time minus delay when the frame came in) and
  /// steers towards the reference.
  void Compare(std::uint32_t received, std::int64_t own) {
    const auto difference = static_cast<std::int32_t>(static_cast<std::uint32_t>(own) - received);
    constexpr std::int32_t kStep = 1000;  // the loop changes the speed of the clock, it never jumps
    steer_ -= std::clamp(difference / 4, -kStep, kStep);
    const std::int64_t magnitude = difference < 0 ? -static_cast<std::int64_t>(difference) : difference;
    mean_ += (magnitude - mean_) / 4;
    ahead_ = difference >= 0;
  }
  /// Register 0x092C: mean magnitude, bit 31 while the own time is the later one.
  [[nodiscard]] std::uint32_t DifferenceRegister() const {
    return static_cast<std::uint32_t>(mean_ & 0x7FFFFFFF) | (ahead_ && mean_ != 0 ? 0x80000000U : 0U);
  }
  void Reset() { mean_ = 0; }

 private:
  std::int64_t ppb_;
  std::int64_t start_;
  TimeNs power_on_;
  std::int64_t steer_ = 0;
  std::int64_t mean_ = 0;
  bool ahead_ = false;
};

}  // namespace ecaudit::samples
