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
  [[nodiscard]] bool active() const { return Lasting::AnyActive(error_, still_, wrong_way_, slow_, rest_); }

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

  /// Steps of an actual value: since homing was started, or while a velocity is far below its target.
  struct Steps {
    std::optional<std::int64_t> last;
    std::uint32_t count = 0;
    bool up = false, one_way = true;

    void Step(std::int64_t actual) {
      const std::int64_t step = last ? Apart(*last, actual) : 0;
      last = actual;
      if (step == 0) return;
      one_way = count == 0 || (one_way && up == (step > 0));
      up = step > 0;
      ++count;
    }
  };
  /// A homing that was started, and showed no end so far.
  struct Search {
    FrameRef since;
    FrameRef moved;     ///< the last change of the actual value
    bool open = false;  ///< bit 12 was 0 since the start: that of an earlier homing may stay for a while
  };
  /// What the drive showed while its velocity was far below the target.
  struct Slow {
    std::optional<std::int64_t> from;  ///< position where it began
    std::int64_t level = 0;            ///< the velocity that it keeps, apart from noise ...
    FrameRef level_since;              ///< ... since then
    Steps steps;
    bool keeps_sign = true;  ///< it had the direction of the target all the time, and was not near 0

    void Step(std::int64_t target, std::int64_t actual, const std::optional<std::int64_t>& position,
              const FrameRef& frame);
    /// It keeps a velocity that is not 0: an axis at rest shows noise around 0.
    [[nodiscard]] bool IsSteady(const FrameRef& frame) const;
    /// The axis may turn, though its velocity in this unit is far below the target.
    [[nodiscard]] bool Turns(const FrameRef& frame) const;
  };

  void Follows(const FrameRef& frame);
  void Bits(const AxisView& now, AxisRecords& out);
  void Position(const AxisView& now, AxisRecords& out);
  /// An axis that lags: whether it then rests together with its target.
  void Rest(const Way& way, bool behind, const AxisView& now, AxisRecords& out);
  void Profile(const AxisView& now, AxisRecords& out);
  void Homing(const AxisView& now, AxisRecords& out);
  void HomingLeft(const AxisView& now, AxisRecords& out) const;
  void HomingRuns(const AxisView& now, std::int64_t moved, AxisRecords& out);
  void Velocity(const AxisView& now, AxisRecords& out);
  void Torque(const AxisView& now, AxisRecords& out);
  /// Adds `fact` once it has held for `limit`. @return whether it did so in this step
  static bool Report(AxisFact fact, Lasting& lasting, bool holds, TimeNs limit, const Way& way, const AxisView& now,
                     AxisRecords& out);

  std::optional<std::int8_t> mode_;
  bool enabled_ = false;
  bool restart_ = true;
  bool started_ = false;   ///< profile position, homing: bit 4 rose
  std::int64_t goal_ = 0;  ///< profile position: the target then; velocities: when the axis stood still
  bool stood_ = false;     ///< since that start, or with this goal, the axis was reported to stand still
  Place begin_;            ///< where the motion began, or both were seen to move alike last
  std::int64_t last_target_ = 0;
  Place together_;   ///< where both moved together last
  Place slow_from_;  ///< since when the actual value makes less than half of the way
  Place rest_at_;    ///< where both rest
  Lasting error_, still_, wrong_way_, slow_, rest_, runs_;
  std::int64_t moved_from_ = 0;  ///< profile position: since where the actual value hardly moves
  Approach approach_;            ///< velocities, torques
  Slow slow_window_;             ///< velocities: while slow_ holds
  Steps steps_;                  ///< homing
  std::optional<Search> search_;
  AxisLead error_lead_;  ///< before error_ began
  FrameRef follows_, followed_;
};

}  // namespace ecaudit::progress
