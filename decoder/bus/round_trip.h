/// How long frames are on their way, by the pairs that leave no doubt, and what that shows of others.
#pragma once

#include <algorithm>
#include <cstdint>

#include "decoder/base/time.h"
#include "decoder/bus/thresholds.h"

namespace ecaudit::bus {

using ecaudit::Elapsed;
[[nodiscard]] inline bool AreTimed(const FrameRef& a, const FrameRef& b) {
  return a.has_time && b.has_time;
}
/// Nanoseconds; both have time stamps.
[[nodiscard]] inline std::int64_t Elapsed(const FrameRef& from, const FrameRef& to) {
  return Elapsed(from.time, to.time);
}

class RoundTrip {
 public:
  /// A pair that nothing overtook, and that is no repetition.
  void Add(std::int64_t ns) noexcept {
    constexpr std::int64_t kWeight = 16;
    typical_ns_ += typical_ns_ == 0 ? ns : (ns - typical_ns_) / kWeight;
  }
  /// Running average; 0 until there was one.
  [[nodiscard]] std::int64_t typical_ns() const noexcept { return typical_ns_; }
  [[nodiscard]] bool known() const noexcept { return typical_ns_ != 0; }
  /// Stamps are fine enough to measure it.
  [[nodiscard]] bool IsFine() const noexcept { return known() && typical_ns_ <= threshold::kFineRoundTripNs; }
  [[nodiscard]] bool IsLate(std::int64_t ns) const noexcept { return ns / threshold::kLateTimes > typical_ns_; }
  [[nodiscard]] bool IsLateOfTwo(std::int64_t ns) const noexcept {
    return ns / threshold::kLateOfTwoTimes > typical_ns_;
  }
  /// True when a master may have waited for one frame before it sent the next one: longer than frames take.
  [[nodiscard]] bool HasWaited(std::int64_t apart) const noexcept {
    return apart > threshold::kCopyNs && apart / 2 > typical_ns_;
  }
  /// Nothing takes much longer on its way than the others. With stamps too coarse for that, frames go by alone.
  [[nodiscard]] bool IsSoon(const FrameRef& first, const FrameRef& second) const noexcept {
    if (!AreTimed(first, second)) return true;
    const std::int64_t longest =
        IsFine() ? std::min(threshold::kRecentNs, threshold::kLateTimes * typical_ns_) : threshold::kRecentNs;
    return Elapsed(first, second) <= longest;
  }
  /// Out for longer than any other.
  [[nodiscard]] bool IsOverFor(std::int64_t age) const noexcept {
    return age > threshold::kSilentNs && age / threshold::kSilentRoundTrips > typical_ns_;
  }

 private:
  std::int64_t typical_ns_ = 0;
};

}  // namespace ecaudit::bus
