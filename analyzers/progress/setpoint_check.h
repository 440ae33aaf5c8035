/// in: an axis, moment by moment.  out: targets that no drive can follow: jumps, echoes of the actual value, limits.
///
/// An echo shows where the speed of the actual value changes, at the latest when it begins to move: while both move at
/// one speed the actual value may just be ahead, as that of an axis that sags. In whole increments one speed is steps
/// of two neighbouring sizes.
///
/// A jump is reported only with what came of it: the axis runs after it, or a fault or following error. A target that
/// was 0 and stays so where nothing moves may be one that the drive does not use.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/lasting.h"

namespace ecaudit::progress {

class SetpointCheck {
 public:
  void Step(const AxisView& now, AxisRecords& out);
  void Forget() { *this = {}; }
  /// What stays of it where the capture misses frames: how often the target came back, which a pause ends.
  [[nodiscard]] SetpointCheck AfterGap() const {
    SetpointCheck kept;
    kept.returns_ = returns_;
    kept.returns_.target.reset();
    kept.returns_.actual.reset();
    kept.returns_.step = 0;
    return kept;
  }
  /// As EnableCheck's.
  [[nodiscard]] bool active() const { return jump_ || outlier_ || outside_.active() || spike_ || motion_.step != 0; }

 private:
  struct Jump {
    AxisRecord record;
    std::int64_t distance = 0;
    std::int64_t target = 0, actual = 0;
    std::int64_t last_target = 0;
    std::int64_t largest_step = 0;
  };

  void AtEnable(const AxisView& now, AxisRecords& out);
  void AfterOutlier(const AxisView& now, AxisRecords& out);
  void TakeTarget(const AxisView& now);
  void Spike(const AxisView& now);
  void Echo(const AxisView& now, AxisRecords& out);
  [[nodiscard]] bool Leads(std::int64_t target);
  void Alternates(const AxisView& now, AxisRecords& out);
  void Rhythm(const AxisView& now, AxisRecords& out);
  void ReportRhythm(const AxisView& now, AxisRecords& out);
  void Limits(const AxisView& now, AxisRecords& out);

  std::optional<std::int8_t> mode_;
  bool enabled_ = false;
  std::optional<Jump> jump_;
  // Steps of the target while enabled.
  std::optional<std::int64_t> last_target_;
  std::array<std::int64_t, 16> steps_{};
  std::size_t step_count_ = 0;
  std::optional<AxisRecord> outlier_;
  std::uint32_t cycles_after_ = 0;
  std::optional<AxisRecord> spike_;  ///< reported if no other one follows soon
  std::uint32_t cycles_quiet_ = 0;   ///< since then
  // Echo.
  std::array<std::optional<std::int64_t>, 3> actuals_;  ///< of the steps before, newest first
  std::uint64_t echoes_ = 0;
  bool leads_ = false;  ///< the actual value was seen to change its speed first
  /// Steps of the actual value in a row that the target repeats with the same delay.
  struct Repeats {
    std::uint32_t values = 0;
    std::int64_t least = 0, most = 0;  ///< steps
  };
  std::array<Repeats, 2> repeats_;  ///< one cycle later, two cycles later
  std::int64_t echo_from_ = 0;
  FrameRef echo_since_;
  bool echo_told_ = false;
  Lasting outside_;
  struct Outside {
    std::optional<std::int64_t> target, actual;  ///< actual: it was outside as well
  } outside_from_;                               ///< the last target within the limits, or the first one known
  /// A large step of the target, and steps back in its next change.
  struct Returns {
    std::optional<std::int64_t> target;
    std::int64_t step = 0;               ///< the last change, if it was large
    std::optional<std::int64_t> actual;  ///< at this change
    std::uint64_t count = 0;
    FrameRef first, last;
    bool told = false;
  };
  Returns returns_;
  /// Steps of one direction, one cycle after the other or some cycles apart.
  struct Motion {
    std::int64_t step = 0;                             ///< the last one; 0: the target rests
    std::uint32_t waited = 0;                          ///< cycles since then
    FrameRef first;                                    ///< cycle without a new target, of those that are counted
    std::uint64_t steps = 0, prompt = 0;               ///< steps, and those without a cycle in between
    std::uint64_t waits = 0, cycles = 0, made_up = 0;  ///< the others, their cycles, and steps that make up for them
    std::uint32_t longest = 0;
    bool told = false;
  };
  Motion motion_;
};

}  // namespace ecaudit::progress
