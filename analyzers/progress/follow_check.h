/// in: an axis, moment by moment.  out: whether the actual value goes where the set point goes.
///
/// Positions: how far both moved since they last moved together. Velocities: the values. Status bits 11 and 13 are the
/// drive's own word.
///
/// Source: CIA402, status word; cyclic synchronous position, profile position, homing.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/lasting.h"

namespace ecaudit::progress {

class FollowCheck {
 public:
  void Step(const AxisView& now, AxisRecords& out);
  void Forget();

  /// The first moment at which the actual value was seen to follow.
  [[nodiscard]] const FrameRef& follows() const { return follows_; }

 private:
  void Bits(const AxisView& now, AxisRecords& out);
  void Position(const AxisView& now, AxisRecords& out);
  void Velocity(const AxisView& now, AxisRecords& out);
  void Restart(std::int64_t target, std::int64_t actual);

  std::optional<std::int8_t> mode_;
  bool enabled_ = false;
  bool restart_ = true;
  std::int64_t target_ = 0, actual_ = 0;              ///< where both moved together last
  std::int64_t start_target_ = 0, start_actual_ = 0;  ///< where they began
  Lasting error_, limit_, still_, wrong_way_, slow_;
  FrameRef follows_;
};

}  // namespace ecaudit::progress
