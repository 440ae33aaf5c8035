/// Which packets a slice takes: ranges of frame numbers, and a range in frames or seconds that bounds them.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "cli/stream/frame_range.h"

namespace ecaudit::cli {

class FrameChoice {
 public:
  /// Every packet within `range`.
  explicit FrameChoice(FrameRange range) : range_(range) {}
  /// Of these, only the frames given and `context` packets before and after each.
  FrameChoice(FrameRange range, std::vector<FrameNo> frames, FrameNo context) : range_(range), spans_(std::in_place) {
    std::ranges::sort(frames);
    for (const FrameNo frame : frames) {
      const FrameNo first = frame > context ? frame - context : 1;
      const FrameNo last = frame > kLast - context ? kLast : frame + context;
      if (!spans_->empty() && first <= spans_->back().second + 1) {
        spans_->back().second = last;
      } else {
        spans_->emplace_back(first, last);
      }
    }
  }

  /// To be asked with ascending frame numbers.
  [[nodiscard]] bool Contains(FrameNo frame, std::optional<double> seconds) {
    if (!range_.Contains(frame, seconds)) return false;
    if (!spans_) return true;
    while (next_ < spans_->size() && (*spans_)[next_].second < frame) ++next_;
    return next_ < spans_->size() && (*spans_)[next_].first <= frame;
  }
  /// The last frame that can be asked for.
  [[nodiscard]] FrameNo last() const {
    const FrameNo end = range_.to_frame.value_or(kLast);
    if (!spans_) return end;
    return spans_->empty() ? 0 : std::min(end, spans_->back().second);
  }

 private:
  static constexpr FrameNo kLast = std::numeric_limits<FrameNo>::max() - 1;

  FrameRange range_;
  std::optional<std::vector<std::pair<FrameNo, FrameNo>>> spans_;  ///< ascending, apart from each other
  std::size_t next_ = 0;
};

}  // namespace ecaudit::cli
