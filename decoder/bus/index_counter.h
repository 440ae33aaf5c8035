/// in: the indices of frames, one after the other.  out: whether each is the one that was to come next.
///
/// Nothing is known of the counter beforehand: how far it counts, where it begins and by how much it goes on is what
/// the frames show. It goes on from the first datagram of the frame before, or from the last one where every datagram
/// has a number of its own. A step back to the lowest index is taken for the place where the counter restarts, until
/// it shows that it is not; only where it has restarted at the same place twice is one from elsewhere odd. 0 and 255
/// are what masters write into frames that they do not number: they count only where the counter is seen to come to
/// them and to go on.
#pragma once

#include <cstdint>
#include <optional>

namespace ecaudit::bus {

class IndexCounter {
 public:
  enum class Step : std::uint8_t {
    kUnknown,  ///< shows nothing
    kFollows,  ///< the index that was to come next
    kOdd,      ///< another one
    kBegins,   ///< back to the lowest: the counter may have been set back
  };

  [[nodiscard]] Step Follow(std::uint8_t first, std::uint8_t last) noexcept {
    const auto more = static_cast<std::uint8_t>(last - first);
    if (more > most_) most_ = more;
    // Nearly always.
    if (any_ && !aside_ && first > last_first_ && first == last_first_ + stride_ && !AtEnd()) {
      other_seen_ = 0;
      Note(true);
      if (first > highest_) highest_ = first;
      last_first_ = first;
      last_ = last;
      return Step::kFollows;
    }
    return FollowAny(first, last);
  }
  /// Goes on from this frame; whatever lies between is no step.
  void MoveTo(std::uint8_t first, std::uint8_t last) noexcept;

  /// True when it has gone on like this often enough, and lately.
  [[nodiscard]] bool IsRegular() const noexcept {
    return steps_ >= kEnough && (steps_ - unsigned{regular_}) * kOneOddIn <= steps_;
  }
  /// True when it has gone on like this in each of a few steps: not yet enough to be sure.
  [[nodiscard]] bool IsRegularSoFar() const noexcept { return steps_ >= kFirst && steps_ == regular_; }
  /// True when it has gone on like this in every step of late.
  [[nodiscard]] bool LeavesNoneOut() const noexcept { return steps_ >= kEnough && steps_ == regular_; }
  [[nodiscard]] bool IsNext(std::uint8_t first) const noexcept { return any_ && Follows(first); }
  /// True when it restarts at this index, as far as seen.
  [[nodiscard]] bool IsBegin(std::uint8_t first) const noexcept { return ends_ > 0 && first == begin_; }
  /// By how much it goes on.
  [[nodiscard]] std::uint8_t stride() const noexcept { return stride_; }
  /// Of the last odd step: how many frames at least would lie between, if the counter had gone on.
  [[nodiscard]] std::uint32_t skipped() const noexcept { return skipped_; }
  /// How many frames further the index is the same again, as far as seen; never 0.
  [[nodiscard]] std::uint32_t round() const noexcept;
  /// True when the index follows the last one, by at most `count`.
  [[nodiscard]] bool IsAfter(std::uint8_t first, std::uint64_t count) const noexcept;

 private:
  /// Steps that the judgement rests on, at most 32, and how many of them may be odd.
  static constexpr unsigned kEnough = 8;
  static constexpr unsigned kMost = 32;
  static constexpr unsigned kOneOddIn = 8;
  /// Steps that only make it likely.
  static constexpr unsigned kFirst = 3;
  /// So often the same distance has to be seen before it is that of the counter.
  static constexpr std::uint8_t kStrideSeen = 3;
  /// So often it has restarted at the same place before another place is odd.
  static constexpr std::uint8_t kSureOfEnd = 2;
  /// A counter that was not seen to restart: few indices, or as many as TwinCAT has and more.
  static constexpr std::uint32_t kFew = 16;
  static constexpr std::uint32_t kMany = 112;

  /// The index of the datagram that a frame beginning with `first` goes on from: the first or the last of one before.
  [[nodiscard]] std::optional<std::uint8_t> FollowedFrom(std::uint8_t first, std::uint8_t from_first,
                                                         std::uint8_t from_last) const noexcept;
  [[nodiscard]] bool AtEnd() const noexcept { return ends_ > 0 && (last_ == end_ || (last_first_ == end_ && !each_)); }
  [[nodiscard]] bool Follows(std::uint8_t first) const noexcept;
  [[nodiscard]] Step FollowAny(std::uint8_t first, std::uint8_t last) noexcept;
  [[nodiscard]] Step FollowUnnumbered(std::uint8_t first, std::uint8_t last) noexcept;
  void LearnEnd(std::uint8_t begin) noexcept;
  void LearnStride(std::uint8_t first) noexcept;
  [[nodiscard]] std::uint8_t FramesBefore(std::uint8_t first) const noexcept;
  void Note(bool regular) noexcept {
    constexpr std::uint32_t kAllRegular = 0xFFFF'FFFF;
    constexpr std::uint32_t kAllButOldest = kAllRegular >> 1U;
    if (regular && history_ == kAllRegular) return;  // nearly always: nothing changes
    if (history_ > kAllButOldest) --regular_;
    history_ = (history_ & kAllButOldest) << 1U | (regular ? 1U : 0U);
    if (regular) ++regular_;
    if (steps_ < kMost) ++steps_;
  }

  bool any_ = false;
  bool each_ = false;             ///< a frame of several indices was followed from its last one, lately
  bool aside_ = false;            ///< the frame before had an index that may be no number, and was left out ...
  std::uint8_t aside_first_ = 0;  ///< ... this one
  std::uint8_t aside_last_ = 0;
  std::uint8_t last_first_ = 0;  ///< of the first datagram of the last frame
  std::uint8_t last_ = 0;        ///< of its last datagram
  std::uint8_t most_ = 0;        ///< indices that a frame had after its first one
  std::uint8_t lowest_ = 0;      ///< of the first datagrams of all frames
  std::uint8_t highest_ = 0;
  std::uint8_t stride_ = 1;
  std::uint8_t other_stride_ = 0;  ///< seen instead ...
  std::uint8_t other_seen_ = 0;    ///< ... so often in a row
  std::uint8_t skipped_ = 0;       ///< see skipped()
  std::uint8_t end_ = 0;           ///< the last index before it restarts ...
  std::uint8_t begin_ = 0;         ///< ... at this one; both only where ends_ is not 0
  std::uint8_t ends_ = 0;          ///< how often that was seen
  std::uint8_t steps_ = 0;         ///< in history_ ...
  std::uint8_t regular_ = 0;       ///< ... and of these, regular ones
  std::uint32_t history_ = 0;      ///< 1: the step was regular; newest in bit 0
};

}  // namespace ecaudit::bus
