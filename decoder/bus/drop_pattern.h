/// in: where packets are missing in a capture.  out: whether they are missing at a regular distance.
///
/// A recorder that leaves out every 124th packet leaves out returned frames mostly, and looks like a bus that loses
/// them. But a bus loses frames when something happens to it, not at regular intervals of captured packets; and where
/// nothing comes back between two frames that did not, it is silent. Where the distance is that of the frames as well,
/// it may be either: then packets of both directions have to be missing, or the first one at just that distance from
/// the beginning.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "decoder/base/ids.h"

namespace ecaudit::bus {

class DropPattern {
 public:
  /// Minimum of equal distances, and of distances for one that differs.
  static constexpr std::uint64_t kEnough = 5;
  static constexpr std::uint64_t kOneOddIn = 10;

  /// The return of an outbound frame is missing. @param outbound frames sent up to it
  void MissReturn(FrameNo sent, std::uint64_t outbound) noexcept { Add({sent, outbound, true}); }
  /// The outbound copy of a returned frame is missing.
  void MissOutbound(FrameNo returned, std::uint64_t outbound) noexcept { Add({returned - 1, outbound, false}); }
  void Finish() noexcept;

  /// After Finish(): packets from one that is missing to the next; 0: not regular.
  [[nodiscard]] std::uint64_t distance() const { return distance_; }
  /// Returns that are missing at that distance.
  [[nodiscard]] std::uint64_t returns() const { return distance_ == 0 ? 0 : regular_returns_; }

 private:
  struct Gap {
    FrameNo behind = 0;          ///< last packet before it
    std::uint64_t outbound = 0;  ///< outbound frames before it
    bool is_return = false;
  };
  /// Gaps become known a little out of order.
  static constexpr std::size_t kOpen = 64;
  /// A packet of another kind may be missing between two gaps.
  static constexpr std::uint64_t kMostBetween = 4;
  /// With several frames in flight it is not known to the packet where a return stood. Of a short distance so much
  /// would be too large a part.
  static constexpr std::uint64_t kSlack = 2;
  static constexpr std::uint64_t kLong = 32;

  void Add(const Gap& gap) noexcept;
  void Take(const Gap& gap) noexcept;
  [[nodiscard]] std::uint64_t PeriodsIn(std::uint64_t apart) const noexcept;

  std::array<Gap, kOpen> open_{};  ///< sorted
  std::size_t open_count_ = 0;
  Gap last_;
  std::uint64_t gaps_ = 0;
  std::uint64_t returns_ = 0;
  std::uint64_t period_ = 0;
  std::uint64_t frame_period_ = 0;
  std::uint64_t between_ = 0;  ///< packets between the gaps that are alike, ...
  std::uint64_t periods_ = 0;  ///< ... and how many periods these are
  std::uint64_t regular_ = 0;
  std::uint64_t regular_returns_ = 0;
  std::uint64_t frames_differ_ = 0;
  bool from_beginning_ = false;
  std::uint64_t distance_ = 0;
};

}  // namespace ecaudit::bus
