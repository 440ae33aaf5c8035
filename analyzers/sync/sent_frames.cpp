#include "analyzers/sync/sent_frames.h"

namespace ecaudit::sync {

std::uint64_t SentFrames::UnreturnedBetween(FrameNo before, FrameNo after) const {
  std::uint64_t count = 0;
  for (std::uint64_t i = outputs_count_; i > 0 && outputs_count_ - i < kOutputs; --i) {
    const FrameNo number = outputs_[(i - 1) % kOutputs];
    if (number <= before) break;
    if (after == 0 || number < after) ++count;
  }
  return count;
}

}  // namespace ecaudit::sync
