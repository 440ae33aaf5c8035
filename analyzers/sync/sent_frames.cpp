#include "analyzers/sync/sent_frames.h"

#include <algorithm>

namespace ecaudit::sync {

namespace {

bool WritesTo(const track::KnownFmmus& fmmus, std::uint32_t address, std::uint16_t length) {
  return std::any_of(fmmus.active.begin(), fmmus.active.end(), [&](const auto& unit) {
    return unit.fmmu.writes() && !unit.fmmu.Overlap(address, length).empty();
  });
}

}  // namespace

void SentFrames::Returned(FrameNo sent) {
  for (std::uint64_t i = outputs_count_; i > 0 && outputs_count_ - i < kOutputs; --i) {
    Outputs& outputs = outputs_[(i - 1) % kOutputs];
    if (outputs.frame < sent) return;
    if (outputs.frame == sent) outputs.returned = true;
  }
}

std::uint64_t SentFrames::UnreturnedBetween(FrameNo before, FrameNo after, const track::KnownFmmus& fmmus) const {
  std::uint64_t count = 0;
  FrameNo counted = 0;
  for (std::uint64_t i = outputs_count_; i > 0 && outputs_count_ - i < kOutputs; --i) {
    const Outputs& outputs = outputs_[(i - 1) % kOutputs];
    if (outputs.frame <= before) break;
    if (outputs.returned || outputs.frame == counted || (after != 0 && outputs.frame >= after)) continue;
    if (!WritesTo(fmmus, outputs.address, outputs.length)) continue;
    counted = outputs.frame;
    ++count;
  }
  return count;
}

}  // namespace ecaudit::sync
