#include "analyzers/sync/cyclic_images.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace ecaudit::sync {
namespace {

/// Made-up stamps shall not make sums of cycles overflow.
constexpr TimeNs kLongestCycle = 60'000'000'000;

/// Most of the newest intervals are about the same.
template <class Newest>
bool IsRhythm(Newest newest) {
  std::array<TimeNs, kEnoughIntervals> sorted{};
  for (std::uint64_t i = 0; i < kEnoughIntervals; ++i) sorted[i] = std::min(newest(i), kLongestCycle);
  std::sort(sorted.begin(), sorted.end());
  const TimeNs least = sorted[kEnoughIntervals / 8];
  const TimeNs most = sorted[kEnoughIntervals - 1 - kEnoughIntervals / 8];
  return most - least <= sorted[kEnoughIntervals / 2] / 8;
}

}  // namespace

std::pair<const IntervalStatistics*, TimeBase> CyclicImage::Best() const {
  // A clock that covers only some of the frames does not show the cycle.
  const std::uint64_t most = std::max({by_dc.count(), by_esl.count(), by_stamp.count()});
  if (most == 0) return {&by_stamp, TimeBase::kNone};
  if (by_dc.count() * 10 >= most * 9) return {&by_dc, TimeBase::kDc};
  if (by_esl.count() * 10 >= most * 9) return {&by_esl, TimeBase::kEsl};
  return {&by_stamp, TimeBase::kCapture};
}

bool CyclicImage::SentNext(FrameNo frame) const {
  for (std::uint64_t i = sent_count; i > 1 && sent_count - i < kSent - 1; --i) {
    if (sent[(i - 1) % kSent] == frame) return sent[(i - 2) % kSent] == last.frame.number;
  }
  return false;
}

bool CyclicImage::Add(const FrameTime& time, bool was_sent, bool taken, bool in_op) {
  if (time.frame.number == last.frame.number) return false;
  const Intervals since(last, time);
  const FrameRef from = last.frame;
  const bool next = was_sent ? last_was_sent && SentNext(time.frame.number) : !last_was_sent;
  last = time;
  last_was_sent = was_sent;
  gap_from = from.number;
  gap = since.Best();
  const bool both_in_op = std::exchange(in_op_, in_op) && in_op;
  if (in_op && !both_in_op) op_intervals_ = kept_ = 0;
  const bool counts = next && from.seen();
  if (counts) AddInterval(since, from, time.frame);
  rhythm = since.By(rhythm_base());
  if (counts && taken && rhythm.base != TimeBase::kNone) Note(rhythm.ns, both_in_op);
  has_nominal_ = nominal_of >= kEnoughIntervals && nominal_ns > 0 && (!in_op_ || holds_in_op());
  return counts;
}

void CyclicImage::AddInterval(const Intervals& since, const FrameRef& from, const FrameRef& to) {
  const auto add = [&](IntervalStatistics& statistics, const Interval& interval) {
    if (interval.base != TimeBase::kNone) statistics.Add(interval.ns, from, to);
  };
  add(by_dc, since.By(TimeBase::kDc));
  add(by_esl, since.By(TimeBase::kEsl));
  add(by_stamp, since.By(TimeBase::kCapture));
}

void CyclicImage::Note(TimeNs interval, bool in_op) {
  recent_[intervals_++ % kRecent] = interval;
  if (in_op && op_intervals_ < kEnoughIntervals) {
    ++op_intervals_;
    kept_ = CountKept();
    // Where they are a rhythm, and another one than before, that has nothing to do with it.
    const auto newest = [this](std::uint64_t i) { return recent_[(intervals_ - 1 - i) % kRecent]; };
    if (op_intervals_ == kEnoughIntervals && 2 * kept_ < op_intervals_ && IsRhythm(newest)) {
      counted_from_ = intervals_ - op_intervals_;
    }
  }
  constexpr std::uint64_t kRenewed = 4 * kRecent;  // sorting is dear
  const std::uint64_t counted = intervals_ - counted_from_;
  const bool first = counted == kEnoughIntervals || counted == 2 * kEnoughIntervals || counted == kRecent;
  if (first || counted % kRenewed == 0) RenewNominal(std::min<std::uint64_t>(counted, kRecent));
}

/// @param count  of the last intervals
void CyclicImage::RenewNominal(std::size_t count) {
  std::array<TimeNs, kRecent> sorted{};
  for (std::size_t i = 0; i < count; ++i) sorted[i] = recent_[(intervals_ - 1 - i) % kRecent];
  const auto at = [&](std::size_t quarters) {
    return sorted.begin() + static_cast<std::ptrdiff_t>(count * quarters / 4);
  };
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(sorted.begin(), at(2), end);
  std::nth_element(sorted.begin(), at(1), at(2));
  std::nth_element(at(2), at(3), end);
  nominal_ns = std::min(*at(2), kLongestCycle);
  spread_ns = std::min(*at(3), kLongestCycle) - std::min(*at(1), kLongestCycle);
  nominal_of = intervals_;
}

/// Of the intervals in OP, which are few still.
std::uint64_t CyclicImage::CountKept() const {
  const TimeNs near = std::min(std::max(nominal_ns / 8, spread_ns), nominal_ns / 3);
  std::uint64_t kept = 0;
  for (std::uint64_t i = 0; i < op_intervals_; ++i) {
    const TimeNs off = std::abs(std::min(recent_[(intervals_ - 1 - i) % kRecent], kLongestCycle) - nominal_ns);
    if (off <= near) ++kept;
  }
  return kept;
}

CyclicImage* CyclicImages::Find(wire::Command command, std::uint32_t address) {
  for (CyclicImage& image : images_) {
    if (!image.used) {
      image.used = true;
      image.address = address;
      image.command = command;
      return &image;
    }
    if (image.address == address && image.command == command) return &image;
  }
  return nullptr;
}

void CyclicImages::ForgetLast() {
  for (CyclicImage& image : images_) image.last = {};
}

const CyclicImage* CyclicImages::Busiest() const {
  const auto most = std::max_element(images_.begin(), images_.end(), [](const CyclicImage& a, const CyclicImage& b) {
    return a.Best().first->count() < b.Best().first->count();
  });
  return most->Best().first->count() == 0 ? nullptr : &*most;
}

}  // namespace ecaudit::sync
