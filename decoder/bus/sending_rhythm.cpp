#include "decoder/bus/sending_rhythm.h"

#include <algorithm>
#include <utility>

namespace ecaudit::bus {

void SendingRhythm::CompareStamps(std::int64_t apart) noexcept {
  shared_score_ = apart > 0 ? std::max(shared_score_ - 1, 0)
                            : std::min(shared_score_ + threshold::kSharedOneIn, threshold::kSharedScoreMost);
}

bool SendingRhythm::TakeDistance(std::int64_t apart) noexcept {
  constexpr std::int64_t kWeight = 16;
  const std::int64_t longest = std::max(longest_ns_, longest_before_ns_);
  const bool few =
      frames_ >= threshold::kRhythmFewFrames && indices.loose() && apart / threshold::kSilenceOfFewTimes > longest;
  const bool silent = (known() || few) && apart / threshold::kSilenceTimes > longest;
  const std::int64_t counted = silent ? longest : apart;
  mean_ns_ += mean_ns_ == 0 ? counted : (counted - mean_ns_) / kWeight;
  longest_ns_ = std::max(longest_ns_, apart);
  if (apart > 0 && (shortest_ns_ == 0 || apart < shortest_ns_)) shortest_ns_ = apart;
  if (apart > 0 && (nearest_ns_ == 0 || apart < nearest_ns_)) nearest_ns_ = apart;
  if (++frames_ >= threshold::kRhythmFrames) {
    nearest_before_ns_ = std::exchange(nearest_ns_, 0);
    longest_before_ns_ = std::max<std::int64_t>(longest_ns_, 1);
    longest_ns_ = 0;
    frames_ = 0;
  }
  return silent;
}

std::uint32_t SendingRhythm::IndicesThatMayBeMissing(std::int64_t apart) const noexcept {
  const std::uint32_t span = indices.span();
  const std::int64_t distance =
      HasSharedStamps() ? threshold::kShortestFrameNs : std::max(mean_ns_ / 2, threshold::kShortestFrameNs);
  return (std::int64_t{span} - 1) * distance <= apart ? std::max(span, 1U) : 0;
}

bool SendingRhythm::HasTimeForSkipped(const FrameRef& from, const FrameRef& to, const RoundTrip& trip) const noexcept {
  if (!AreTimed(from, to) || !trip.IsFine() || HasSharedStamps() || ClockJumps(from.time, to.time)) return true;
  const std::int64_t shortest = longest_before_ns_ > 0 ? shortest_ns_ / 2 : 0;
  const std::int64_t each = std::max(shortest, threshold::kShortestFrameNs);
  return indices.skipped() * each <= 2 * Elapsed(from, to) + threshold::kStampErrorNs;
}

bool SendingRhythm::HasTimeAtRate(std::int64_t apart) const noexcept {
  if (HasSharedStamps() || !known()) return true;
  const std::int64_t nearest = nearest_before_ns_ == 0 || (nearest_ns_ != 0 && nearest_ns_ < nearest_before_ns_)
                                   ? nearest_ns_
                                   : nearest_before_ns_;
  const std::int64_t frames = std::int64_t{indices.skipped()} + 1;
  return nearest - nearest / threshold::kFasterByOneIn <= apart / frames;
}

bool SendingRhythm::OnlyOneFits(const FrameRef& sent, const FrameRef& returned) const noexcept {
  if (!AreTimed(sent, returned) || shortest_ns_ == 0 || HasSharedStamps()) return false;
  const std::int64_t apart = Elapsed(sent, returned);
  return apart > 0 && apart / 2 < shortest_ns_;
}

}  // namespace ecaudit::bus
