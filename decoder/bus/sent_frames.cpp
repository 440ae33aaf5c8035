#include "decoder/bus/sent_frames.h"

#include <cstring>
#include <numeric>
#include <utility>

namespace ecaudit::bus {

SentFrames::SentFrames() noexcept {
  std::iota(place_.begin(), place_.end(), std::uint16_t{0});
}

SentFrame& SentFrames::Add(const wire::FrameView& frame, ByteSpan kept) noexcept {
  TakeWarmSlot();
  SentFrame& slot = (*this)[head_];
  slot.sequence = head_++;
  slot.state = SentFrame::State::kOpen;
  slot.followed_by_other = slot.before_gap = false;
  slot.overtaken = 0;
  TakeBytes(slot.bytes, kept);
  slot.view.Rebase(frame, slot.bytes);
  return slot;
}

/// Frames return at once nearly always: a slot that has just become free is used again, so that the same few stay in
/// the cache.
void SentFrames::TakeWarmSlot() noexcept {
  const std::uint64_t free = std::min(tail_, recent());
  if (free > 0) std::swap(place_[head_ % kSlots], place_[(free - 1) % kSlots]);
}

void TakeBytes(std::vector<std::uint8_t>& room, ByteSpan bytes) noexcept {
  constexpr std::size_t kUsualBytes = 1536;
  if (room.capacity() == 0) room.reserve(kUsualBytes);
  if (room.size() != bytes.size()) room.resize(bytes.size());  // seldom: frames of the same few sizes take turns
  if (!bytes.empty()) std::memcpy(room.data(), bytes.data(), bytes.size());
}

}  // namespace ecaudit::bus
