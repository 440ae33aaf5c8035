#include "decoder/bus/doubled_packets.h"

#include <algorithm>
#include <cstring>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/bus/direction.h"

namespace ecaudit::bus {
namespace {

/// Both copies of one packet are stamped within this.
constexpr std::int64_t kTogetherNs = 200'000;
/// Minimum of frames that appear twice, besides nine of ten.
constexpr std::uint32_t kLeastTwice = 8;

std::uint64_t WholeContent(const wire::FrameView& frame) {
  std::uint64_t hash = frame.source_mac();
  const ByteSpan bytes = frame.payload();
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min(sizeof word, bytes.size() - at));
    hash = WrappingProduct(hash ^ word, std::uint64_t{0x9E3779B97F4A7C15});
    hash ^= hash >> 29U;
  }
  return hash;
}

bool AreTogether(const FrameRef& first, const FrameRef& second) {
  if (!first.has_time || !second.has_time) return true;
  const std::int64_t apart = Elapsed(first.time, second.time);
  return apart >= -kTogetherNs && apart <= kTogetherNs;
}

}  // namespace

/// @return true when it is one of the packets before it, and no other copy of that frame stands between them
bool DoubledPackets::Match(const wire::FrameView& frame) noexcept {
  const std::uint64_t content = WholeContent(frame);
  for (std::size_t back = 1; back <= last_.size(); ++back) {
    Seen& before = last_[(next_ + last_.size() - back) % last_.size()];
    if (!before.frame.seen() || before.key != frame.key()) continue;
    if (before.content != content || before.twice || !AreTogether(before.frame, frame.ref())) break;
    before.twice = true;
    return true;
  }
  last_[next_] = {frame.key(), content, frame.ref(), false};
  next_ = (next_ + 1) % last_.size();
  return false;
}

void DoubledPackets::Learn(const wire::FrameView& frame) noexcept {
  if (frame.kind() != wire::FrameKind::kEtherCat || frame.empty()) return;
  const bool second = Match(frame);
  Count& count = AnyWorkingCounter(frame) ? taken_ : others_;
  ++(second ? count.twice : count.once);
}

void DoubledPackets::Finish() noexcept {
  const auto nearly_all = [](const Count& count) { return count.twice * 10 >= count.once * 9; };
  found_ = taken_.twice >= kLeastTwice && nearly_all(taken_) && (others_.once < kLeastTwice || nearly_all(others_));
  last_ = {};
}

bool DoubledPackets::IsSecond(const wire::FrameView& frame) noexcept {
  return found_ && frame.kind() == wire::FrameKind::kEtherCat && !frame.empty() && Match(frame);
}

}  // namespace ecaudit::bus
