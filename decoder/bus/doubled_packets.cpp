#include "decoder/bus/doubled_packets.h"

#include <algorithm>
#include <cstring>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/bus/direction.h"
#include "decoder/bus/thresholds.h"

namespace ecaudit::bus {
namespace {

/// Both copies of one packet are stamped within this, where all packets are in the capture twice.
constexpr std::int64_t kTogetherNs = 200'000;
/// Minimum of frames that appear twice, besides nine of ten.
constexpr std::uint32_t kLeastTwice = 8;
/// Had the master sent both copies, both would have returned: two for each that was sent, and not up to three for two.
constexpr std::uint32_t kMostReturns = 3, kOfSent = 2;

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

bool AreTogether(const FrameRef& first, const FrameRef& second, std::int64_t together_ns) {
  if (!first.has_time || !second.has_time) return true;
  const std::int64_t apart = Elapsed(first.time, second.time);
  return apart >= -together_ns && apart <= together_ns;
}

}  // namespace

bool DoubledPackets::Window::Match(const wire::FrameView& frame, std::int64_t together_ns) noexcept {
  const std::uint64_t content = WholeContent(frame);
  for (std::size_t back = 1; back <= last.size(); ++back) {
    Seen& before = last[(next + last.size() - back) % last.size()];
    if (!before.frame.seen() || before.key != frame.key()) continue;
    if (before.content != content || before.twice || !AreTogether(before.frame, frame.ref(), together_ns)) break;
    before.twice = true;
    return true;
  }
  last[next] = {frame.key(), content, frame.ref(), false};
  next = (next + 1) % last.size();
  return false;
}

void DoubledPackets::Learn(const wire::FrameView& frame) noexcept {
  if (frame.kind() != wire::FrameKind::kEtherCat || frame.empty()) return;
  const bool taken = AnyWorkingCounter(frame);
  (taken ? taken_ : others_).Add(window_.Match(frame, kTogetherNs));
  if (!taken) sent_.Add(sent_window_.Match(frame, threshold::kCopyNs));
}

void DoubledPackets::Finish() noexcept {
  const auto nearly_all = [](const Count& count) { return count.twice * 10 >= count.once * 9; };
  const auto many = [](const Count& count) { return count.once >= kLeastTwice && count.twice >= kLeastTwice; };
  if (taken_.twice >= kLeastTwice && nearly_all(taken_) && (others_.once < kLeastTwice || nearly_all(others_))) {
    twice_ = Twice::kAll;
  } else if (many(sent_) && nearly_all(sent_) && taken_.once >= kLeastTwice &&
             taken_.once / kMostReturns <= sent_.once / kOfSent) {
    twice_ = Twice::kSent;
  }
  window_ = {};
  sent_window_ = {};
}

bool DoubledPackets::IsSecond(const wire::FrameView& frame) noexcept {
  if (twice_ == Twice::kNone || frame.kind() != wire::FrameKind::kEtherCat || frame.empty()) return false;
  if (twice_ == Twice::kAll) return window_.Match(frame, kTogetherNs);
  return !AnyWorkingCounter(frame) && sent_window_.Match(frame, threshold::kCopyNs);
}

}  // namespace ecaudit::bus
