#include "decoder/bus/index_counter.h"

#include <algorithm>

namespace ecaudit::bus {
namespace {

/// What masters write into frames that they do not number.
constexpr bool MayBeNoNumber(std::uint8_t index) {
  return index == 0 || index == 255;
}

}  // namespace

std::optional<std::uint8_t> IndexCounter::FollowedFrom(std::uint8_t first, std::uint8_t from_first,
                                                       std::uint8_t from_last) const noexcept {
  if (from_last != from_first && first == static_cast<std::uint8_t>(from_last + 1U)) return from_last;
  if (first == static_cast<std::uint8_t>(from_first + stride_)) return from_first;
  return std::nullopt;
}

bool IndexCounter::Follows(std::uint8_t first) const noexcept {
  return FollowedFrom(first, last_first_, last_) || (AtEnd() && first == begin_);
}

std::uint32_t IndexCounter::round() const noexcept {
  if (ends_ > 0) return std::uint32_t{static_cast<std::uint8_t>(end_ - begin_)} + 1;
  const std::uint32_t seen = std::uint32_t{static_cast<std::uint8_t>(highest_ - lowest_)} + 1;
  // Who counts further than SOEM and did not begin where TwinCAT does counts to the end.
  if (seen > kFew) return lowest_ < kMany ? 256 : kMany;
  return seen;
}

bool IndexCounter::IsAfter(std::uint8_t first, std::uint64_t count) const noexcept {
  if (!any_) return false;
  const std::uint32_t whole = ends_ > 0 ? round() : 256;
  const std::uint32_t behind = (std::uint32_t{last_first_} + whole - first % whole) % whole;
  return behind > 0 && behind <= count;
}

void IndexCounter::MoveTo(std::uint8_t first, std::uint8_t last) noexcept {
  lowest_ = any_ ? std::min(lowest_, first) : first;
  highest_ = any_ ? std::max(highest_, first) : first;
  any_ = true;
  aside_ = false;
  last_first_ = first;
  last_ = last;
}

void IndexCounter::LearnEnd(std::uint8_t begin) noexcept {
  const bool same = ends_ > 0 && AtEnd() && begin == begin_;
  ends_ = same ? static_cast<std::uint8_t>(std::min(ends_ + 1, 255)) : std::uint8_t{1};
  if (same) return;
  // Where not each datagram has a number, the last one may hold anything.
  end_ = each_ ? last_ : last_first_;
  begin_ = begin;
}

void IndexCounter::LearnStride(std::uint8_t first) noexcept {
  const auto stride = static_cast<std::uint8_t>(first - last_first_);
  other_seen_ = stride == other_stride_ ? static_cast<std::uint8_t>(other_seen_ + 1U) : std::uint8_t{1};
  other_stride_ = stride;
  if (other_seen_ < kStrideSeen) return;
  stride_ = stride;
  other_seen_ = 0;
}

/// Where every datagram has a number, the frames between may each have as many as the largest one so far.
std::uint8_t IndexCounter::FramesBefore(std::uint8_t first) const noexcept {
  const std::uint32_t whole = ends_ > 0 ? round() : 256;
  const unsigned step = each_ ? unsigned{most_} + 1 : std::max<unsigned>(stride_, 1);
  const std::uint32_t ahead = (first % whole + 2 * whole - last_first_ % whole) % whole;
  return static_cast<std::uint8_t>(ahead > step ? (ahead - 1) / step : 0);
}

/// Left out, until the frame after it shows that it was one of the numbers.
IndexCounter::Step IndexCounter::FollowUnnumbered(std::uint8_t first, std::uint8_t last) noexcept {
  aside_ = true;
  aside_first_ = first;
  aside_last_ = last;
  return Step::kUnknown;
}

IndexCounter::Step IndexCounter::FollowAny(std::uint8_t first, std::uint8_t last) noexcept {
  if (!any_) {
    // A master that scans without numbers would else have to number many frames before they count.
    if (first == 255) return FollowUnnumbered(first, last);
    MoveTo(first, last);
    return Step::kUnknown;
  }
  if (aside_ && FollowedFrom(first, aside_first_, aside_last_)) {
    if (aside_first_ < last_) LearnEnd(aside_first_);
    Note(true);
    MoveTo(aside_first_, aside_last_);
    MoveTo(first, last);
    return Step::kFollows;
  }
  if (Follows(first)) {
    // Where every datagram has a number, the counter may have restarted within the frame before: what counts is the
    // datagram that this frame goes on from, not the first one.
    const std::optional<std::uint8_t> from = FollowedFrom(first, last_first_, last_);
    if (!from || first < *from) {
      LearnEnd(first);
    } else if (ends_ > 0 && *from == end_) {
      ends_ = 0;  // it goes on from there: it had only been set back
    }
    if (from && last_ != last_first_) each_ = *from == last_;
    other_seen_ = 0;
    Note(true);
    MoveTo(first, last);
    return Step::kFollows;
  }
  const bool is_number = ends_ >= kSureOfEnd && (first == begin_ || first == end_);
  if (MayBeNoNumber(first) && !is_number && first != last_first_) return FollowUnnumbered(first, last);
  aside_ = false;
  Note(false);
  skipped_ = FramesBefore(first);
  const bool back = first < last_first_;
  const bool begins = first <= lowest_ || (ends_ > 0 && first == begin_);
  Step step = Step::kOdd;
  if (first == last_first_ || (back && begins && ends_ < kSureOfEnd)) {
    step = Step::kUnknown;
  } else if (back && begins) {
    step = Step::kBegins;
  }
  if (back && ends_ < kSureOfEnd) LearnEnd(first);
  if (first > last_first_) {
    LearnStride(first);
    lowest_ = highest_ = first;  // what was before may have been another way of numbering
  }
  MoveTo(first, last);
  return step;
}

}  // namespace ecaudit::bus
