/// in: an axis, moment by moment.  out: targets that no drive can follow: jumps, echoes of the actual value, limits.
///
/// An echo shows where the step of the actual value changes, at the latest when it begins to move: while both move by
/// equal steps the actual value may just be ahead.
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
  /// As EnableCheck's.
  [[nodiscard]] bool active() const { return jump_ || outlier_ || outside_.active(); }

 private:
  struct Jump {
    AxisRecord record;
    std::int64_t distance = 0;
    std::int64_t target = 0, actual = 0;
    std::int64_t last_target = 0;
    std::int64_t largest_step = 0;
  };

  void AtEnable(const AxisView& now, AxisRecords& out);
  void InOperation(const AxisView& now, AxisRecords& out);
  void Echo(const AxisView& now, AxisRecords& out);
  [[nodiscard]] bool Varies(std::size_t at) const;  ///< as the target repeats the value of `at`
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
  // Echo.
  std::array<std::optional<std::int64_t>, 4> actuals_;  ///< of the steps before, newest first
  std::optional<std::int64_t> echo_target_;             ///< of the step before
  std::uint64_t echoes_ = 0;
  std::uint64_t varied_ = 0;  ///< times that it repeated a step that differs from the one before
  std::int64_t echo_from_ = 0;
  FrameRef echo_since_;
  bool echo_told_ = false;
  Lasting outside_;
};

}  // namespace ecaudit::progress
