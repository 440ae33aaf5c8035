/// A condition that has to hold for some time before it means something.
#pragma once

#include <cstdint>

#include "decoder/base/ids.h"
#include "decoder/base/time.h"

namespace ecaudit::progress {

class Lasting {
 public:
  /// Of fewer frames nothing is concluded, however far apart they are.
  static constexpr std::uint32_t kLeastFrames = 5;

  /// @return how long it has held; 0 where it does not, or that is not known
  TimeNs Hold(bool holds, const FrameRef& frame) {
    if (!holds) {
      Reset();
      return 0;
    }
    if (!since_.seen()) since_ = frame;
    ++frames_;
    if (frames_ < kLeastFrames || !since_.has_time || !frame.has_time) return 0;
    return Elapsed(since_.time, frame.time);
  }
  void Reset() {
    since_ = {};
    frames_ = 0;
    told_ = false;
  }
  /// True once in each episode.
  [[nodiscard]] bool Report() {
    if (told_) return false;
    told_ = true;
    return true;
  }
  /// The condition holds at the moment.
  [[nodiscard]] bool active() const { return since_.seen(); }
  /// Whether one of them is: asked in each cycle of each axis, and hardly ever so.
  template <class... Each>
  [[nodiscard]] static bool AnyActive(const Each&... each) {
    return (each.since_.number | ...) != 0;
  }
  [[nodiscard]] const FrameRef& since() const { return since_; }

 private:
  FrameRef since_;
  std::uint32_t frames_ = 0;
  bool told_ = false;
};

}  // namespace ecaudit::progress
