/// Where a frame stands in the text that `decode` writes: the line number for CI servers.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/result/finding.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::cli {

/// Counts the lines of all frames that pass, so that no capture is read for that once more.
///
/// Keeps: one entry wherever frames have another number of lines than those before, kMostRuns at most.
class LineCounter final : public capture::FrameSource {
 public:
  static constexpr std::size_t kMostRuns = 1'000'000;

  explicit LineCounter(std::unique_ptr<capture::FrameSource> source) : source_(std::move(source)) {}

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override;
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return source_->info(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return source_->bytes_read(); }
  [[nodiscard]] std::uint64_t bytes_total() const noexcept override { return source_->bytes_total(); }

  /// The line of that frame, from 1; a frame without a line of its own is reported where it would stand. Nothing for
  /// frames that did not pass, or passed when there was no room any more.
  [[nodiscard]] std::optional<std::uint64_t> LineOf(FrameNo frame) const;

 private:
  struct Run {
    FrameNo first = 0;
    std::uint64_t line = 0;  ///< of the first frame
    std::uint32_t each = 0;  ///< lines of a frame
  };

  std::unique_ptr<capture::FrameSource> source_;
  std::vector<Run> runs_;
  FrameNo last_ = 0;        ///< frame that is counted
  std::uint64_t line_ = 2;  ///< of the next frame; the first one holds the titles of the columns
};

/// For each finding the line of its first frame in `ecaudit decode` of the whole capture; 0 where it has none.
[[nodiscard]] std::vector<std::uint64_t> DecodeLines(const LineCounter& counter, std::span<const std::string> paths,
                                                     std::span<const Finding> findings);

}  // namespace ecaudit::cli
