/// in: the frames of one sender in the order of the capture.  out: whether two programs number them, each by a counter
/// of its own, in turn.
///
/// A frame belongs to the row whose last index it goes on from. One that goes on from neither begins a row in the place
/// of the one that was silent longer. One master may have several counters as well (process data and all else, one for
/// each slave): see Collide() for what only two masters do.
#pragma once

#include <array>
#include <cstdint>

#include "decoder/base/ids.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class TwoCounters {
 public:
  struct Row {
    FrameRef began;
    FrameRef last;
    std::uint64_t frames = 0;
    std::uint64_t answered = 0;          ///< frames that slaves took part in
    std::uint64_t unanswered = 0;        ///< frames to station addresses that none took part in, since the other began
    std::uint64_t set_up_positions = 0;  ///< that it gave a station address, modulo 64
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
  /// The row of the last frame, and the other one.
  [[nodiscard]] const Row& current() const { return rows_[current_]; }
  [[nodiscard]] const Row& other() const { return rows_[1 - current_]; }
  /// The row that began later.
  [[nodiscard]] const Row& later() const { return rows_[rows_[0].began.number > rows_[1].began.number ? 0 : 1]; }
  /// How often the turn has passed between the rows that there are now, when both had enough frames to be no chance.
  [[nodiscard]] std::uint64_t turns() const { return turns_; }
  /// True when slaves take part in the frames of both rows, and both gave a station address to the same slave.
  [[nodiscard]] bool SetUpTwice() const;
  /// True when slaves take part in the frames of both rows, but one of them no longer reaches the station addresses
  /// that it uses since the other one began.
  [[nodiscard]] bool Collide() const;

 private:
  /// From this number of frames on a row is no chance.
  static constexpr std::uint64_t kProven = 4;
  /// This number of frames without answer are no single refusals.
  static constexpr std::uint64_t kManyUnanswered = 8;

  [[nodiscard]] bool BothAnswered() const { return rows_[0].answered >= kProven && rows_[1].answered >= kProven; }
  [[nodiscard]] std::size_t RowOf(std::uint8_t index) const noexcept;

  std::array<Row, 2> rows_{};
  std::size_t current_ = 0;
  std::uint64_t turns_ = 0;
  std::uint64_t sent_key_ = 0;  ///< of the last frame
};

}  // namespace ecaudit::bus
