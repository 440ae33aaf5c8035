/// in: an axis, moment by moment.  out: whether the actual value goes where the set point goes.
///
/// Positions: how far both moved since they last moved together. Velocities: the values. Status bits 11 and 13 are the
/// drive's own word.
///
/// Source: CIA402, status word; cyclic synchronous position, profile position, homing.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/progress/approach.h"
#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/lasting.h"

namespace ecaudit::progress {

class FollowCheck {
 public:
  void Step(const AxisView& now, AxisRecords& out);
  void Forget();
  /// As EnableCheck's.
  [[nodiscard]] bool active() const {
    return error_.active() || still_.active() || wrong_way_.active() || slow_.active();
  }

  /// The first moment at which the actual value was seen to follow.
  [[nodiscard]] const FrameRef& follows() const { return follows_; }
  /// The last one, or where homing was attained.
  [[nodiscard]] const FrameRef& followed() const { return followed_; }

 private:
  struct Place {
    std::int64_t target = 0, actual = 0;
  };
  /// How far target and actual value went from a place.
  struct Way {
    std::int64_t target = 0, actual = 0;
    [[nodiscard]] bool SameDirection() const { return actual == 0 || (actual > 0) == (target > 0); }
  };
  [[nodiscard]] static Way WayFrom(const Place& from, std::int64_t target, std::int64_t actual) {
    return {Apart(from.target, target), Apart(from.actual, actual)};
  }

  void Follows(const FrameRef& frame);
  void Bits(const AxisView& now, AxisRecords& out);
  void Position(const AxisView& now, AxisRecords& out);
  void Profile(const AxisView& now, AxisRecords& out);
  void Homing(const AxisView& now, AxisRecords& out);
  void Velocity(const AxisView& now, AxisRecords& out);
  /// Adds `fact` once it has held for `limit`.
  static void Report(AxisFact fact, Lasting& lasting, bool holds, TimeNs limit, const Way& way, const AxisView& now,
                     AxisRecords& out);

  std::optional<std::int8_t> mode_;
  bool enabled_ = false;
  bool restart_ = true;
  bool started_ = false;   ///< profile position: bit 4 rose
  std::int64_t goal_ = 0;  ///< likewise: the target then
  Place begin_;            ///< where the motion began, or both were seen to move alike last
  std::int64_t last_target_ = 0;
  Place together_;   ///< where both moved together last
  Place slow_from_;  ///< since when the actual value makes less than half of the way
  Lasting error_, still_, wrong_way_, slow_;
  std::int64_t moved_from_ = 0;  ///< profile position: since where the actual value hardly moves
  Approach approach_;            ///< velocities
  FrameRef follows_, followed_;
};

}  // namespace ecaudit::progress
