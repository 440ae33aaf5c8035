#include "analyzers/sync/output_rate.h"

#include <algorithm>
#include <cstdlib>

namespace ecaudit::sync {
namespace {

/// Cycles, or frames whose number of cycles stays open: longer ones are pauses.
constexpr TimeNs kPause = 16;
/// By no more than this part of a cycle intervals may differ from whole ones.
constexpr TimeNs kFirm = 4;
/// Frames whose intervals differ from whole cycles by more than this part in the mean show no pause for certain.
constexpr TimeNs kScattered = 8;

}  // namespace

double OutputRate::JitterShare() const {
  if (sum_.ns <= 0 || intervals_ == 0) return 0;
  // First and last frame are wrong by as much as an interval is: hardly ever by more than three times the usual.
  const double ends =
      std::min(3 * static_cast<double>(off_) / static_cast<double>(intervals_), static_cast<double>(most_off_));
  // Frames that follow a pause all at once make up for it. What is left of both may be jitter as well, and so may a
  // pause be among frames that are usually off by much.
  const bool scattered = off_ / static_cast<TimeNs>(intervals_) > nominal_ / kScattered;
  const std::int64_t doubtful = scattered           ? std::abs(sum_.doubtful) + sum_.left_out
                                : sum_.doubtful < 0 ? sum_.doubtful + sum_.left_out
                                                    : sum_.doubtful;
  const double cycles = static_cast<double>(std::abs(doubtful)) + static_cast<double>(sum_.open) / 2;
  return (ends + cycles * static_cast<double>(nominal_)) / static_cast<double>(sum_.ns);
}

OutputRate::Look OutputRate::LookAt(const CyclicImage& image, TimeNs configured) const {
  // Where frames are late and early by much, so is a median of few of them.
  const auto is_about = [&](TimeNs cycle, TimeNs other) {
    return std::abs(cycle - other) <= std::min(std::max(other / kSameRhythm, image.spread_ns), other / 3);
  };
  Look look;
  // What came last is newer than the median of the image.
  const bool by_turn = nominal_ > 0 && strange_ >= kEnoughIntervals && IsRhythm();
  look.measured = by_turn ? strange_ns_ / static_cast<TimeNs>(strange_) : image.nominal_ns;
  look.next = is_about(look.measured, configured) ? configured : look.measured;
  look.other = nominal_ > 0 && look.next > 0 && !is_about(look.next, nominal_);
  look.turned = look.other && (by_turn || seen_strange_ > seen_ / 2);
  return look;
}

bool OutputRate::Renew(const CyclicImage& image, TimeNs configured, bool frames_missing) {
  renewed_at_ = image.nominal_of;
  const Look look = LookAt(image, configured);
  if (look.turned && !frames_missing) {
    sum_ = strange_ > 0 ? turn_ : firm_;
    next_ = look.next;
    return true;
  }
  if (!look.other && look.next > 0) {
    nominal_ = look.next;
    usual_ = look.measured;
    firm_ = sum_;
  }
  seen_ = seen_strange_ = 0;
  return false;
}

void OutputRate::AddInFull(const Interval& interval, const FrameRef& from, const FrameRef& to) {
  if (interval.base == TimeBase::kNone) return;
  if (interval.ns > kPause * nominal_ + nominal_ / 2) {
    open_ns_ = open_ = 0;
    strange_ = 0;
    return;
  }
  if (interval.base != base_) {
    base_ = interval.base;
    sum_ = firm_ = {};
    open_ns_ = open_ = 0;
    strange_ = 0;
  }
  if (sum_.cycles == 0 && open_ == 0) {
    first_ = from;
    off_ = most_off_ = 0;
    intervals_ = 0;
  }
  ++intervals_;
  TimeNs off = std::abs(interval.ns - nominal_);
  const bool one = off <= nominal_ / kFirm;  // nearly always
  if (!one) off = OffOf(interval.ns);
  off_ += off;
  most_off_ = std::max(most_off_, off);
  ++seen_;
  if (off <= nominal_ / kSameRhythm && one) {
    strange_ = 0;
  } else {
    if (strange_++ == 0) BeginTurn(from);
    strange_ns_ += interval.ns;
    strange_least_ = strange_ == 1 ? interval.ns : std::min(strange_least_, interval.ns);
    strange_most_ = strange_ == 1 ? interval.ns : std::max(strange_most_, interval.ns);
    ++seen_strange_;
  }
  if (one && open_ == 0) {
    Count(interval.ns, 1, to);
  } else {
    Close(open_ns_ + interval.ns, to);
  }
}

/// The strange intervals are about the same: those of frames that are lost or late at random are not.
bool OutputRate::IsRhythm() const {
  return strange_ > 0 && strange_most_ - strange_least_ <= strange_ns_ / static_cast<TimeNs>(strange_) / 2;
}

void OutputRate::BeginTurn(const FrameRef& from) {
  turn_ = sum_;
  turn_from_ = from;
  strange_ns_ = 0;
}

void OutputRate::GoOnFromTurn(const FrameRef& last) {
  const Sum strange{strange_, 0, 0, 0, strange_ns_, last};
  const FrameRef from = turn_from_;
  const TimeNs nominal = next_;
  const std::uint64_t renewed_at = renewed_at_;
  BeginAnew();
  nominal_ = usual_ = nominal;
  renewed_at_ = renewed_at;
  if (strange.cycles == 0) return;
  sum_ = firm_ = strange;
  first_ = from;
}

/// From the nearest whole number of cycles.
TimeNs OutputRate::OffOf(TimeNs interval) const {
  return std::abs(interval - (interval + nominal_ / 2) / nominal_ * nominal_);
}

void OutputRate::Close(TimeNs since, const FrameRef& to) {
  const TimeNs cycles = (since + nominal_ / 2) / nominal_;
  const bool whole = OffOf(since) <= nominal_ / kFirm;
  const TimeNs frames = open_ + 1;
  if (!whole && frames < kPause) {
    open_ = frames;
    open_ns_ = since;
    return;
  }
  open_ns_ = open_ = 0;
  // Late by nearly a cycle is as far from whole ones as hardly early: one each is as likely. So is it for none.
  if (frames > 1 || cycles == 0) {
    sum_.doubtful += cycles - frames;
  } else {
    sum_.left_out += cycles - 1;
  }
  if (!whole) ++sum_.open;
  Count(since, cycles, to);
}

void OutputRate::Count(TimeNs since, TimeNs cycles, const FrameRef& to) {
  // Made-up stamps shall not make the sum overflow.
  if (__builtin_add_overflow(sum_.ns, since, &sum_.ns)) {
    BeginAnew();
    return;
  }
  sum_.cycles += static_cast<std::uint64_t>(cycles);
  sum_.last = to;
}

void OutputRate::BeginAnew() {
  const TimeBase base = base_;
  *this = {};
  base_ = base;
}

}  // namespace ecaudit::sync
