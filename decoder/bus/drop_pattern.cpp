#include "decoder/bus/drop_pattern.h"

#include <algorithm>

namespace ecaudit::bus {

void DropPattern::Add(const Gap& gap) noexcept {
  if (open_count_ == open_.size()) {
    Take(open_[0]);
    std::move(open_.begin() + 1, open_.end(), open_.begin());
    --open_count_;
  }
  std::size_t at = open_count_++;
  for (; at > 0 && open_[at - 1].behind > gap.behind; --at) open_[at] = open_[at - 1];
  open_[at] = gap;
}

void DropPattern::Take(const Gap& gap) noexcept {
  ++gaps_;
  if (gap.is_return) ++returns_;
  // Damage may have put them in another order: then they are no distance apart.
  const std::uint64_t apart = gap.behind > last_.behind ? gap.behind - last_.behind : 0;
  const std::uint64_t frames = gap.outbound > last_.outbound ? gap.outbound - last_.outbound : 0;
  // Nothing came back between two: a time in which no slave answered, whatever the distance.
  const bool silent = gaps_ > 1 && gap.is_return && last_.is_return && apart > 0 && apart == frames;
  if (silent) {
    last_ = gap;
    return;
  }
  const bool first = gaps_ == 1;
  const bool last_is_return = last_.is_return;
  last_ = gap;
  // One distance alone may be part of the true one.
  const std::uint64_t periods = PeriodsIn(apart);
  const bool alike = periods == 1 || (periods > 1 && regular_ > 0);
  if (!alike) {
    // Another one shows where there was no regular distance so far.
    if (regular_ >= kEnough) return;
    period_ = apart;
    frame_period_ = frames;
    regular_ = frames_differ_ = 0;
    between_ = apart;
    periods_ = 1;
    regular_returns_ = gap.is_return ? 1 : 0;
    if (!first && last_is_return) ++regular_returns_;
    from_beginning_ = first;
    return;
  }
  ++regular_;
  between_ += apart;
  periods_ += periods;
  if (gap.is_return) ++regular_returns_;
  if (apart == period_ && frames != frame_period_) ++frames_differ_;
}

/// How many times the period, give or take; 0: not so.
std::uint64_t DropPattern::PeriodsIn(std::uint64_t apart) const noexcept {
  if (period_ == 0 || apart == 0) return 0;
  const std::uint64_t slack = period_ >= kLong ? kSlack : 0;
  const std::uint64_t periods = (apart + slack) / period_;
  return periods <= kMostBetween && apart + slack - periods * period_ <= 2 * slack ? periods : 0;
}

void DropPattern::Finish() noexcept {
  for (std::size_t i = 0; i < open_count_; ++i) Take(open_[i]);
  open_count_ = 0;
  const bool regular = regular_ >= kEnough && (gaps_ - regular_) * kOneOddIn <= gaps_ + 2 * kOneOddIn;
  const bool of_packets = frames_differ_ > 0 || from_beginning_ || returns_ < gaps_;
  if (regular && of_packets) distance_ = (between_ + periods_ / 2) / periods_ + 1;
}

}  // namespace ecaudit::bus
