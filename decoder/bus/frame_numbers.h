/// in: one frame.  out: the numbers that its master gave it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

/// First and last number of a frame. They differ where each datagram has one.
struct FrameNumbers {
  std::uint8_t first = 0;
  std::uint8_t last = 0;

  [[nodiscard]] bool IsBefore(std::uint8_t number) const noexcept {
    return number == static_cast<std::uint8_t>(first + 1U) || number == static_cast<std::uint8_t>(last + 1U);
  }
};

/// Some masters number each datagram. Others number one of a frame, and leave 0 in the others: TwinCAT numbers the
/// first one of acyclic frames, and of cyclic ones a datagram of process data, wherever it stands.
/// @param frame  not empty
[[nodiscard]] inline FrameNumbers NumbersOf(const wire::FrameView& frame) noexcept {
  const std::size_t size = frame.size();
  const std::uint8_t first = frame[0].index();
  const std::uint8_t last = frame[size - 1].index();
  // Not 0, or each datagram has the number after that of the one before.
  if (first != 0 || (size == 2 && last == 1)) return {first, last};
  std::uint8_t only = 0;
  for (std::size_t i = 1; i < size; ++i) {
    const std::uint8_t index = frame[i].index();
    if (index == 0) continue;
    if (only != 0) return {first, last};
    only = index;
  }
  return {only, only};
}

}  // namespace ecaudit::bus
