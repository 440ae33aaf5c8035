/// `--frames`, `--from`, `--to` of the commands that write a line for each thing that happened.
#pragma once

#include <optional>

#include "analyzers/options/options.h"
#include "decoder/base/ids.h"
#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::cli {

/// Which frames are shown. The whole capture is followed all the same, so that what is known of the slaves does not
/// depend on the range.
struct FrameRange {
  std::optional<double> from_s, to_s;  ///< seconds from the first packet, inclusive
  std::optional<FrameNo> from_frame, to_frame;

  /// @param seconds  from the first packet; absent where the packet has no time stamp (then a limit in seconds counts
  ///                 as met)
  [[nodiscard]] bool Contains(FrameNo frame, std::optional<double> seconds) const {
    return !(from_frame && frame < *from_frame) && !(to_frame && frame > *to_frame) &&
           !(seconds && from_s && *seconds < *from_s) && !(seconds && to_s && *seconds > *to_s);
  }
};

/// The values of the options: `frames` is "743", "743-800", "743-" or "-800"; it narrows --from and --to.
[[nodiscard]] Result<FrameRange> ReadFrameRange(const AnalysisOptions& analysis,
                                                const std::optional<std::string>& frames);

/// A capture whose first time stamp is remembered: the origin of all times shown.
class TimedSource final : public capture::FrameSource {
 public:
  /// @param range  to find out whether a packet lies in it; must outlive this
  TimedSource(capture::FrameSource& source, const FrameRange& range) : source_(source), range_(range) {}

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override {
    const capture::ReadStatus status = source_.Next(frame);
    if (status == capture::ReadStatus::kFrame) {
      if (!origin_ && frame.has_time) origin_ = frame.time;
      if (!reached_) reached_ = range_.Contains(frame.number, Seconds(frame.has_time, frame.time));
    }
    return status;
  }
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return source_.info(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return source_.bytes_read(); }
  [[nodiscard]] std::uint64_t bytes_total() const noexcept override { return source_.bytes_total(); }

  /// Nanoseconds from the first packet; absent without time stamps.
  [[nodiscard]] std::optional<std::int64_t> SinceStart(const FrameRef& frame) const {
    return SinceStart(frame.has_time, frame.time);
  }
  /// The first time stamp.
  [[nodiscard]] FrameRef origin() const { return {1, origin_.value_or(0), origin_.has_value()}; }
  /// A packet lay in the range.
  [[nodiscard]] bool reached_range() const { return reached_; }

 private:
  [[nodiscard]] std::optional<std::int64_t> SinceStart(bool has_time, TimeNs time) const {
    std::int64_t ns = 0;
    if (!origin_ || !has_time || __builtin_sub_overflow(time, *origin_, &ns)) return std::nullopt;
    return ns;
  }
  [[nodiscard]] std::optional<double> Seconds(bool has_time, TimeNs time) const {
    const std::optional<std::int64_t> ns = SinceStart(has_time, time);
    return ns ? std::optional(static_cast<double>(*ns) / 1e9) : std::nullopt;
  }

  capture::FrameSource& source_;
  const FrameRange& range_;
  bool reached_ = false;
  std::optional<TimeNs> origin_;
};

}  // namespace ecaudit::cli
