/// `--from`, `--to` and `--around` of `check` and `batch`: the whole capture is evaluated, and a report shows what
/// touches the window.
#pragma once

#include <memory>
#include <utility>

#include "analyzers/result/analysis_result.h"
#include "cli/report/report.h"
#include "cli/stream/frame_range.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::cli {

/// Learns which packets of a capture lie in a range of time or frames.
class WindowSource final : public capture::FrameSource {
 public:
  WindowSource(std::unique_ptr<capture::FrameSource> source, FrameRange range)
      : source_(std::move(source)), range_(range) {}

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override;
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return source_->info(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return source_->bytes_read(); }
  [[nodiscard]] std::uint64_t bytes_total() const noexcept override { return source_->bytes_total(); }

  /// A packet lay in the range.
  [[nodiscard]] bool reached() const { return first_ != 0; }
  /// From the first to the last packet in the range. If time stamps go backwards, packets between them may lie outside.
  [[nodiscard]] FrameNo first() const { return first_; }
  [[nodiscard]] FrameNo last() const { return last_; }

 private:
  std::unique_ptr<capture::FrameSource> source_;
  FrameRange range_;
  TimeNs origin_ = 0;
  bool has_origin_ = false;
  FrameNo first_ = 0;
  FrameNo last_ = 0;
};

/// Whether one of the frames of `finding` lies in [first, last]. A finding that was repeated counts from its first to
/// its last frame, since those between are not listed; one whose condition lasts, such as a fault that is not reset,
/// counts for all of that time. A finding without any frame is about the whole capture.
[[nodiscard]] bool Touches(const Finding& finding, FrameNo first, FrameNo last);

/// Keeps the findings that touch the window, and their causes.
/// @return the findings that were left out
report::OutsideWindow KeepWindow(FrameNo first, FrameNo last, AnalysisResult& result);

}  // namespace ecaudit::cli
