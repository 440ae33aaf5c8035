/// A value that needs time to get where it should be: a ramp, a reversal.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/progress/axis_view.h"

namespace ecaudit::progress {

class Approach {
 public:
  void Reset() { anchor_.reset(); }
  /// @param least  the smallest change that counts
  /// @return whether `value` came nearer to `goal` than it has been since it was last on its other side
  bool Step(std::int64_t goal, std::int64_t value, std::int64_t least) {
    const bool up = goal > value;
    if (!anchor_ || up != up_) {
      up_ = up;
      anchor_ = Bounded(value);
      return false;
    }
    const std::int64_t way = up ? Bounded(value) - *anchor_ : *anchor_ - Bounded(value);
    if (way < least) return false;
    anchor_ = Bounded(value);
    return true;
  }

 private:
  std::optional<std::int64_t> anchor_;  ///< the nearest so far
  bool up_ = false;
};

}  // namespace ecaudit::progress
