/// in: the frames of one master in the order in which they were sent.  out: whether frames between two of them are
/// missing, by the indices alone.
///
/// Masters number what they send: the index of a frame is one more than that of the frame before, or than that of its
/// last datagram, up to the highest that the master uses (15 with SOEM, 239 with TwinCAT, 255 with others), then from
/// the lowest again. Where a master has kept to that, a frame that does not follow proves that others between are not
/// in the capture. Masters that use one index for everything, or number several kinds of frames side by side, tell
/// nothing; frames with index 0 between others that leave out 0 are not numbered.
#pragma once

#include <cstdint>

#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class IndexSequence {
 public:
  enum class Step : std::uint8_t {
    kUnknown,  ///< the indices do not tell
    kNext,     ///< follows the frame before, or is a whole number of rounds further: see span()
    kBroken,   ///< frames are missing between this and the one before
  };

  /// The next frame. @param repeats it has the key of the frame before, which has not come back: a master may repeat it
  Step Follow(const wire::FrameView& frame, bool repeats) noexcept;
  /// A frame was sent whose index cannot be read.
  void Skip() noexcept { skipped_ = true; }
  /// True when the master is regular and this is the index of its next frame.
  [[nodiscard]] bool IsNext(const wire::FrameView& frame) const noexcept;
  /// True when the index lies at most `count` behind the last one: what was sent before that.
  [[nodiscard]] bool IsBehind(const wire::FrameView& frame, std::uint64_t count) const noexcept;
  /// How many indices the master uses, as far as seen. After so many frames the next one has the same again.
  [[nodiscard]] std::uint32_t span() const {
    const std::uint32_t seen = steps_ == 0 ? 0 : std::uint32_t{highest_} - lowest_ + 1;
    return wrapped_ || seen <= kFew ? seen : kMany;
  }

 private:
  /// Masters use 16 indices (SOEM), or 112 (TwinCAT) and more.
  static constexpr std::uint32_t kFew = 16;
  static constexpr std::uint32_t kMany = 112;
  /// Steps that the judgement rests on, at most 32, and how many of them may be odd for the master to be regular.
  static constexpr unsigned kEnough = 8;
  static constexpr unsigned kMost = 32;
  static constexpr unsigned kOneOddIn = 8;

  [[nodiscard]] bool IsRegular() const noexcept;
  [[nodiscard]] bool Follows(std::uint8_t first) const noexcept;
  [[nodiscard]] bool AtHighest() const noexcept { return last_first_ == highest_ || last_ == highest_; }

  bool any_ = false;             ///< a frame was seen
  bool skipped_ = false;         ///< behind the last one there was one that could not be read
  bool wrapped_ = false;         ///< the highest was followed by the lowest: both are known
  std::uint8_t last_first_ = 0;  ///< of the first datagram of the last frame
  std::uint8_t last_ = 0;        ///< of its last datagram
  std::uint8_t lowest_ = 0;      ///< of the first datagrams of all frames
  std::uint8_t highest_ = 0;
  std::uint8_t odd_from_ = 0;  ///< the last step that was none to the next index ...
  std::uint8_t odd_to_ = 0;    ///< ... 0 to 0: none
  unsigned steps_ = 0;         ///< in history_
  std::uint32_t history_ = 0;  ///< 1: the step was regular; newest in bit 0
};

}  // namespace ecaudit::bus
