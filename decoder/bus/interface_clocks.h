/// in: a capture of two interfaces.  out: by how much their clocks are apart.
///
/// A tap hands what goes out to one interface and what comes back to another. Where each has a clock of its own the
/// stamps of the two show nothing of each other, until the copies of the same frames show how far the clocks are apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "decoder/base/time.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::bus {

/// Round trips of one bus differ by no more.
inline constexpr std::int64_t kRoundTripSpreadNs = 200'000;
/// No frame comes back sooner, also where the line is a simulated one.
inline constexpr std::int64_t kLeastRoundTripNs = 1'000;

/// By how much two distances differ; never negative.
[[nodiscard]] inline std::int64_t Difference(std::int64_t a, std::int64_t b) {
  return a <= b ? Elapsed(a, b) : Elapsed(b, a);
}

struct ClocksApart {
  std::uint16_t outbound = 0;  ///< interface of the outbound copies
  std::uint16_t returned = 0;  ///< ... and of the returned ones, whose clock is to be moved
  std::int64_t ahead_ns = 0;   ///< how much later the clock of `returned` is; negative: earlier
  std::size_t pairs = 0;       ///< frames that show it
  bool in_order = true;        ///< the packets stand in the file as they were on the wire
};

/// Reads so much of a capture as is needed to compare its clocks: the first frames of each interface.
///
/// @return nothing where only one interface has EtherCAT frames, more than two have, or one has both copies; where the
///         stamps may be those of one clock (returns within a millisecond after their frames, or later on a slow
///         line); and where the frames do not show (too few, without stamps, or all alike)
[[nodiscard]] std::optional<ClocksApart> CompareClocks(capture::FrameSource& source) noexcept;

}  // namespace ecaudit::bus
