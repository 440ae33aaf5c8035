/// How many steps of all slaves together a report has room for: it grows with the capture, not with slaves times
/// broadcasts. No master needs so few bytes for a step of a slave, but one that speaks to thousands of them at once.
#pragma once

#include <cstdint>

#include "decoder/pipeline.h"

namespace ecaudit {

class StepRoom {
 public:
  /// @param pipeline must outlive this
  /// @param at_once steps that any capture may have
  /// @param bytes_a_step of the frames, for each one more
  StepRoom(const Pipeline& pipeline, std::uint64_t at_once, std::uint64_t bytes_a_step)
      : pipeline_(pipeline), at_once_(at_once), bytes_a_step_(bytes_a_step) {}

  [[nodiscard]] bool HasRoomFor(std::uint64_t steps) const {
    return steps < at_once_ || (steps - at_once_) * bytes_a_step_ < pipeline_.statistics().frame_bytes;
  }

 private:
  const Pipeline& pipeline_;
  std::uint64_t at_once_, bytes_a_step_;
};

}  // namespace ecaudit
