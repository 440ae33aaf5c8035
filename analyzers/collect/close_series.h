/// in: values in the order of frames, and frames that are worth a closer look.  out: every value around those.
///
/// Buckets show a long capture in little room, and hide what happened from one cycle to the next. What a finding cites
/// is known shortly after it happened, so the last values are remembered until then; around frames that a rule may cite
/// only at the end, they are held until then. Memory is constant.
#pragma once

#include <algorithm>
#include <vector>

#include "analyzers/result/timeline.h"
#include "decoder/base/ids.h"

namespace ecaudit::timeline {

class CloseSeries {
 public:
  static constexpr std::size_t kAround = 20;       ///< values before, and values after the one at the frame
  static constexpr std::size_t kRemembered = 256;  ///< a rule may report a frame that far back
  static constexpr std::size_t kHeld = 8;          ///< frames around which values are held

  void Add(const FrameRef& frame, double value) {
    const CloseValue entry{frame.number, frame.time, value};
    if (!held_.empty()) Hold(entry);
    if (following_ > 0) {
      --following_;
      kept_.push_back(entry);
    }
    if (last_.size() < kRemembered) {
      if (last_.empty()) last_.reserve(kRemembered);
      last_.push_back(entry);
    } else {
      last_[oldest_] = entry;
      oldest_ = (oldest_ + 1) % kRemembered;
    }
  }

  /// Holds the values around `frame`, in case that Keep() asks for it much later.
  void Remember(FrameNo frame) {
    if (held_.size() >= kHeld || last_.empty()) return;
    Held& held = held_.emplace_back();
    held.frame = frame;
    const std::size_t from = last_.size() > kAround ? last_.size() - kAround : 0;
    for (std::size_t i = from; i < last_.size(); ++i) held.values.push_back(Remembered(i));
    held.following = kAround + 1;
  }

  /// Keeps the values around `frame`, also those that are still to come.
  /// @return how many are kept for it in addition; 0 when they are kept already, or long forgotten
  std::size_t Keep(FrameNo frame) {
    const std::size_t size = last_.size();
    if (size == 0) return 0;
    if (size == kRemembered && Remembered(0).frame > frame) return KeepHeld(frame);
    std::size_t at = 0;
    while (at < size && Remembered(at).frame < frame) ++at;
    const std::size_t from = at > kAround ? at - kAround : 0;
    const std::size_t to = at + kAround + 1;  // may lie in the future
    std::vector<CloseValue> around;
    for (std::size_t i = from; i < std::min(to, size); ++i) around.push_back(Remembered(i));
    const std::size_t later = to > size ? to - size : 0;
    const std::size_t promised = later > following_ ? later - following_ : 0;
    following_ = std::max(following_, later);
    return Insert(around) + promised;
  }

  /// In the order of frames.
  [[nodiscard]] const std::vector<CloseValue>& kept() const { return kept_; }

 private:
  struct Held {
    FrameNo frame = 0;
    std::vector<CloseValue> values;
    std::size_t following = 0;  ///< values that are still to be held
  };

  void Hold(const CloseValue& entry) {
    for (Held& held : held_) {
      if (held.following == 0) continue;
      --held.following;
      held.values.push_back(entry);
    }
  }
  std::size_t KeepHeld(FrameNo frame) {
    for (const Held& held : held_) {
      if (held.frame == frame) return Insert(held.values);
    }
    return 0;
  }
  /// @return how many of them were not kept before
  std::size_t Insert(const std::vector<CloseValue>& values) {
    const auto earlier = [](const CloseValue& a, const CloseValue& b) { return a.frame < b.frame; };
    const std::size_t before = kept_.size();
    for (const CloseValue& value : values) {
      const auto end = kept_.begin() + static_cast<std::ptrdiff_t>(before);
      if (!std::binary_search(kept_.begin(), end, value, earlier)) kept_.push_back(value);
    }
    std::inplace_merge(kept_.begin(), kept_.begin() + static_cast<std::ptrdiff_t>(before), kept_.end(), earlier);
    return kept_.size() - before;
  }
  [[nodiscard]] const CloseValue& Remembered(std::size_t i) const { return last_[(oldest_ + i) % last_.size()]; }

  std::vector<CloseValue> last_;  ///< a ring; the oldest at oldest_
  std::size_t oldest_ = 0;
  std::size_t following_ = 0;  ///< values that are still to be kept
  std::vector<CloseValue> kept_;
  std::vector<Held> held_;
};

}  // namespace ecaudit::timeline
