/// in: the frames of one sender in the order of the capture.  out: whether two programs number them, each by a counter
/// of its own, in turn.
///
/// A frame belongs to the sequence whose last index it goes on from. One that goes on from neither begins a sequence in
/// the place of the one that was silent longer. One master may have several counters as well (process data and all
/// else, one for each slave). Two masters are those that undo each other's set-up: see SetUpTwice() and Collide().
#pragma once

#include <array>
#include <cstdint>

#include "decoder/base/ids.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class TwoIndexSequences {
 public:
  struct Sequence {
    FrameRef began;
    FrameRef last;
    std::uint64_t frames = 0;
    std::uint64_t answered = 0;          ///< frames that slaves took part in
    std::uint64_t reached = 0;           ///< of these, frames to station addresses, at most kProven
    std::uint64_t unanswered = 0;        ///< frames to station addresses that none took part in, since `cleared`
    std::uint64_t set_up_positions = 0;  ///< that it gave a station address, modulo 64
    bool cleared = false;                ///< the other one has written the station address of all slaves since it began
    std::uint8_t first_index = 0;        ///< of the first datagram of its last frame
    std::uint8_t last_index = 0;         ///< of the last one
    std::uint8_t lowest_index = 0;       ///< it may restart there

    [[nodiscard]] bool GoesOn(std::uint8_t index) const noexcept {
      return frames > 0 && (index == static_cast<std::uint8_t>(first_index + 1U) ||
                            index == static_cast<std::uint8_t>(last_index + 1U));
    }
    [[nodiscard]] bool Restarts(std::uint8_t index) const noexcept {
      return frames >= kProven && index == lowest_index;
    }
  };

  void FollowSent(const wire::FrameView& frame) noexcept;
  void FollowReturned(const wire::FrameView& frame) noexcept;
  /// The sequence of the last frame, and the other one.
  [[nodiscard]] const Sequence& current() const { return sequences_[current_]; }
  [[nodiscard]] const Sequence& other() const { return sequences_[1 - current_]; }
  /// The one that began later.
  [[nodiscard]] const Sequence& later() const {
    return sequences_[sequences_[0].began.number > sequences_[1].began.number ? 0 : 1];
  }
  /// How often frames of one followed frames of the other, when both had enough frames to be no coincidence.
  [[nodiscard]] std::uint64_t turns() const { return turns_; }
  /// True when slaves take part in the frames of both, and both gave a station address to the same slave.
  [[nodiscard]] bool SetUpTwice() const;
  /// True when slaves take part in the frames of both, and one of them no longer reaches the station addresses that it
  /// gave, since the other one wrote that of all slaves.
  [[nodiscard]] bool Collide() const;
  /// Of the one that Collide() means: frames to station addresses that were not answered.
  [[nodiscard]] std::uint64_t unanswered() const;

 private:
  /// From this number of frames on a sequence is no coincidence.
  static constexpr std::uint64_t kProven = 4;
  /// This number of frames without answer are no single refusals.
  static constexpr std::uint64_t kManyUnanswered = 8;

  [[nodiscard]] bool BothAnswered() const {
    return sequences_[0].answered >= kProven && sequences_[1].answered >= kProven;
  }
  [[nodiscard]] std::size_t SequenceOf(std::uint8_t index) const noexcept;
  [[nodiscard]] static bool IsCutOff(const Sequence& sequence);

  std::array<Sequence, 2> sequences_{};
  std::size_t current_ = 0;
  std::uint64_t turns_ = 0;
  std::uint64_t sent_key_ = 0;  ///< of the last frame
};

}  // namespace ecaudit::bus
