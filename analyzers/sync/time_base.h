/// By which clock two frames are apart, and how well that is known.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "decoder/base/ids.h"
#include "decoder/base/time.h"

namespace ecaudit::sync {

/// Best last.
enum class TimeBase : std::uint8_t {
  kNone,
  kCapture,  ///< stamps of the capture
  kEsl,      ///< stamps that a probe added to each frame
  kDc,       ///< DC system time that the frame itself carried
};

/// "dc", "esl", "capture"; "" for kNone.
[[nodiscard]] constexpr std::string_view Name(TimeBase base) {
  switch (base) {
    case TimeBase::kDc:
      return "dc";
    case TimeBase::kEsl:
      return "esl";
    case TimeBase::kCapture:
      return "capture";
    case TimeBase::kNone:
      break;
  }
  return "";
}

/// DC system time as the reference clock gave it, extended to 64 bit. Times of different epochs cannot be compared:
/// the clock was set, or another slave is the reference.
struct DcTime {
  std::uint64_t ns = 0;
  std::uint32_t epoch = 0;
};

/// When a frame was sent, by each clock that shows it.
struct FrameTime {
  FrameRef frame;  ///< the copy to cite: as the master sent it where captured
  std::optional<DcTime> dc;
  std::optional<TimeNs> esl;
  std::optional<TimeNs> stamp;
};

/// From `a` to `b`; nothing where the clock was set in between, runs backwards, or leaps by a century: a capture may
/// hold any number.
[[nodiscard]] constexpr std::optional<TimeNs> Forward(const DcTime& a, const DcTime& b) {
  constexpr std::uint64_t kCentury = std::uint64_t{1} << 62U;
  if (a.epoch != b.epoch || b.ns <= a.ns || b.ns - a.ns > kCentury) return std::nullopt;
  return static_cast<TimeNs>(b.ns - a.ns);
}

struct Interval {
  TimeNs ns = 0;
  TimeBase base = TimeBase::kNone;
};

/// From `a` to `b` by this clock; kNone when one of them lacks it, when it runs backwards, or was set in between.
[[nodiscard]] inline Interval BetweenBy(TimeBase base, const FrameTime& a, const FrameTime& b) {
  switch (base) {
    case TimeBase::kDc:
      if (a.dc && b.dc) {
        if (const auto ns = Forward(*a.dc, *b.dc)) return {*ns, base};
      }
      return {};
    case TimeBase::kEsl:
      if (a.esl && b.esl && *b.esl >= *a.esl) return {Elapsed(*a.esl, *b.esl), base};
      return {};
    case TimeBase::kCapture:
      if (a.stamp && b.stamp && *b.stamp >= *a.stamp && !ClockJumps(*a.stamp, *b.stamp)) {
        return {Elapsed(*a.stamp, *b.stamp), base};
      }
      return {};
    case TimeBase::kNone:
      break;
  }
  return {};
}

/// From one frame to another, by each clock.
class Intervals {
 public:
  Intervals(const FrameTime& a, const FrameTime& b)
      : dc_(BetweenBy(TimeBase::kDc, a, b)),
        esl_(BetweenBy(TimeBase::kEsl, a, b)),
        stamp_(BetweenBy(TimeBase::kCapture, a, b)),
        same_epoch_(a.dc && b.dc && a.dc->epoch == b.dc->epoch) {}

  /// By this clock, as BetweenBy().
  [[nodiscard]] Interval By(TimeBase base) const {
    if (base == TimeBase::kDc) return dc_;
    if (base == TimeBase::kEsl) return esl_;
    return base == TimeBase::kCapture ? stamp_ : Interval{};
  }
  /// By the best clock that both have, for a single pause; kNone when there is none, or when it runs backwards. If the
  /// reference clock was set in between, it measures nothing: some masters set it in each cycle. What is compared with
  /// other intervals keeps to one clock: CyclicImage::rhythm_base().
  [[nodiscard]] Interval Best() const {
    if (same_epoch_) return dc_;
    return esl_.base != TimeBase::kNone ? esl_ : stamp_;
  }

 private:
  Interval dc_, esl_, stamp_;
  bool same_epoch_;
};

/// Intervals::Best() of the two.
[[nodiscard]] inline Interval Between(const FrameTime& a, const FrameTime& b) {
  return Intervals(a, b).Best();
}

}  // namespace ecaudit::sync
