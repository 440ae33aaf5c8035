#include "cli/decode_lines.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "cli/interrupt.h"
#include "cli/stream/datagram_text.h"
#include "cli/stream/spool.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli {

namespace {

/// Fills in the lines of the frames, which the counter had no room for, by reading the capture again up to the last of
/// them. One that cannot be read twice leaves them at 0.
void CountAgain(std::span<const std::string> paths, std::map<FrameNo, std::uint64_t>& wanted) {
  if (wanted.empty() || !std::ranges::all_of(paths, &Spool::CanBeReadTwice)) return;
  auto source = CapturePaths({paths.begin(), paths.end()}).Open();
  if (!source) return;
  std::uint64_t line = 2;  // the first one holds the titles of the columns
  auto next = wanted.begin();
  capture::CapturedFrame frame;
  while (next != wanted.end() && !InterruptFlag() && (*source)->Next(frame) == capture::ReadStatus::kFrame) {
    const std::uint64_t own = LinesOf(wire::FrameView::Parse(frame));
    // A frame without a line of its own is reported where it would stand.
    for (; next != wanted.end() && next->first <= frame.number; ++next) next->second = line;
    line += own;
  }
}

}  // namespace

capture::ReadStatus LineCounter::Next(capture::CapturedFrame& frame) noexcept {
  const capture::ReadStatus status = source_->Next(frame);
  if (status != capture::ReadStatus::kFrame) return status;
  const auto own = static_cast<std::uint32_t>(LinesOf(wire::FrameView::Parse(frame)));
  const bool another = runs_.empty() || runs_.back().each != own || frame.number != last_ + 1;
  if (another && runs_.size() >= kMostRuns) return status;
  if (another) runs_.push_back({frame.number, line_, own});
  last_ = frame.number;
  line_ += own;
  return status;
}

std::optional<std::uint64_t> LineCounter::LineOf(FrameNo frame) const {
  if (frame > last_ || runs_.empty() || frame < runs_.front().first) return std::nullopt;
  const auto behind =
      std::upper_bound(runs_.begin(), runs_.end(), frame, [](FrameNo a, const Run& b) { return a < b.first; });
  const Run& run = *std::prev(behind);
  return run.line + (frame - run.first) * run.each;
}

std::vector<std::uint64_t> DecodeLines(const LineCounter& counter, std::span<const std::string> paths,
                                       std::span<const Finding> findings) {
  std::vector<std::uint64_t> lines(findings.size());
  std::map<FrameNo, std::uint64_t> missing;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!findings[i].first.seen()) continue;
    if (const auto line = counter.LineOf(findings[i].first.number)) {
      lines[i] = *line;
    } else {
      missing.emplace(findings[i].first.number, 0);
    }
  }
  CountAgain(paths, missing);
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (lines[i] != 0) continue;
    if (const auto found = missing.find(findings[i].first.number); found != missing.end()) lines[i] = found->second;
  }
  return lines;
}

}  // namespace ecaudit::cli
