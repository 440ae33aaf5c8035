/// in: one frame.  out: how far it has come, and what it asks for.
#pragma once

#include <cstdint>

#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

/// How far a frame has come. Of two copies of one frame the one that has come less far is the earlier one.
struct Progress {
  std::uint16_t positions = 0;  ///< sum of the position counters modulo 65536; its start does not matter
  std::uint32_t counted = 0;    ///< sum of the working counters

  bool operator==(const Progress&) const = default;
};

[[nodiscard]] Progress ProgressOf(const wire::FrameView& frame) noexcept;
/// True when `later` has passed more slaves than `earlier`; both are of copies of one frame. The position counters
/// decide where they moved (they do so also when no slave takes part), else the working counters.
[[nodiscard]] constexpr bool Further(const Progress& later, const Progress& earlier) {
  const auto moved = static_cast<std::int16_t>(static_cast<std::uint16_t>(later.positions - earlier.positions));
  return moved != 0 ? moved > 0 : later.counted > earlier.counted;
}

/// The same for frames that ask for the same of the same slaves, whatever index they carry.
[[nodiscard]] std::uint64_t WhatIsAsked(const wire::FrameView& frame) noexcept;
/// True when the frame names slaves by their addresses, and each of these took part.
[[nodiscard]] bool IsAccepted(const wire::FrameView& frame) noexcept;
/// True when a slave visibly acted on any datagram: a working counter above 0.
[[nodiscard]] bool AnyWorkingCounter(const wire::FrameView& frame) noexcept;
/// True when slaves took part in its process data.
[[nodiscard]] bool IsExchanged(const wire::FrameView& frame) noexcept;
/// True when a broadcast is all that it holds.
[[nodiscard]] inline bool IsOnlyBroadcast(const wire::FrameView& frame) {
  return frame.size() == 1 && wire::IsBroadcast(frame[0].command());
}
/// Where it was captured: port of the probe and capture interface.
[[nodiscard]] std::uint32_t PortOf(const wire::FrameView& frame) noexcept;

}  // namespace ecaudit::bus
