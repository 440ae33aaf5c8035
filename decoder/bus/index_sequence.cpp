#include "decoder/bus/index_sequence.h"

#include <algorithm>
#include <array>
#include <bit>

namespace ecaudit::bus {
namespace {

/// Instead of a number of steps: the master numbers several kinds of frames side by side, cyclic and acyclic ones say.
constexpr unsigned kSideBySide = ~0U;

/// SOEM, TwinCAT, and whoever counts in so many bits.
bool MayBeHighest(std::uint8_t index) {
  constexpr std::array<std::uint8_t, 8> kKnown{15, 31, 63, 127, 238, 239, 254, 255};
  return std::find(kKnown.begin(), kKnown.end(), index) != kKnown.end();
}

}  // namespace

bool IndexSequence::IsRegular() const noexcept {
  const auto regular = static_cast<unsigned>(std::popcount(history_));
  return steps_ != kSideBySide && steps_ >= kEnough && (steps_ - regular) * kOneOddIn <= steps_;
}

bool IndexSequence::Follows(std::uint8_t first) const noexcept {
  return first == static_cast<std::uint8_t>(last_first_ + 1U) || first == static_cast<std::uint8_t>(last_ + 1U) ||
         (wrapped_ && AtHighest() && first == lowest_);
}

bool IndexSequence::IsNext(const wire::FrameView& frame) const noexcept {
  return !skipped_ && !frame.empty() && IsRegular() && Follows(frame[0].index());
}

bool IndexSequence::IsBehind(const wire::FrameView& frame, std::uint64_t count) const noexcept {
  if (!any_ || frame.empty()) return false;
  // A step back that was no step of the sequence (a frame with index 0, say) leaves nothing to count by.
  const std::uint32_t round = wrapped_ && span() > 0 ? span() : 256;
  const std::uint32_t behind = (std::uint32_t{last_first_} + round - frame[0].index() % round) % round;
  return behind <= count;
}

IndexSequence::Step IndexSequence::Follow(const wire::FrameView& frame, bool repeats) noexcept {
  if (frame.empty()) {
    skipped_ = true;
    return Step::kUnknown;
  }
  const std::uint8_t first = frame[0].index();
  if (any_ && repeats && first == last_first_) return Step::kUnknown;
  const bool next = any_ && Follows(first);
  // Not numbered, unless the master has few indices and 0 is one of them.
  if (first == 0 && !next && !(wrapped_ && span() <= kFew)) return Step::kUnknown;
  Step step = Step::kUnknown;
  const bool back = any_ && first < last_first_;
  // Where the master begins anew is not known before it has; index 0 may have been taken for none.
  const bool may_begin_anew = back && !next && first <= std::max<std::uint8_t>(lowest_, 1) &&
                              ((wrapped_ && AtHighest()) || MayBeHighest(last_first_));
  const bool was_odd = steps_ > 0 && (history_ & 1U) == 0;
  if (was_odd && !next && first == static_cast<std::uint8_t>(odd_from_ + 1U)) steps_ = kSideBySide;  // and back again
  if (any_ && !skipped_ && !may_begin_anew && steps_ != kSideBySide) {
    if (IsRegular()) step = next ? Step::kNext : Step::kBroken;
    if (step == Step::kBroken && back) {
      if (first == odd_to_ && last_first_ == odd_from_) {
        // Twice the same step back: another master, which begins anew there.
        lowest_ = first;
        highest_ = last_first_;
        step = Step::kUnknown;
      }
    }
    if (!next) {
      odd_from_ = last_first_;
      odd_to_ = first;
    }
    history_ = history_ << 1U | (next ? 1U : 0U);
    steps_ = std::min(steps_ + 1, kMost);
  }
  lowest_ = any_ ? std::min(lowest_, first) : first;
  highest_ = may_begin_anew ? last_first_ : std::max(highest_, first);
  wrapped_ = wrapped_ || back;
  if (!wrapped_ && highest_ > kFew && lowest_ < kMany && IsRegular()) {
    // Who counts further than SOEM and did not begin where TwinCAT does counts to the end.
    highest_ = 255;
    wrapped_ = true;
  }
  any_ = true;
  skipped_ = false;
  last_first_ = first;
  last_ = frame[frame.size() - 1].index();
  return step;
}

}  // namespace ecaudit::bus
