#include "cli/decode_lines.h"

#include <algorithm>
#include <map>

#include "cli/interrupt.h"
#include "cli/stream/datagram_lines.h"
#include "cli/stream/spool.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli {

std::vector<std::uint64_t> DecodeLines(std::span<const std::string> paths, std::span<const Finding> findings) {
  std::vector<std::uint64_t> lines(findings.size());
  std::map<FrameNo, std::uint64_t> wanted;
  for (const Finding& finding : findings) {
    if (finding.first.seen()) wanted.emplace(finding.first.number, 0);
  }
  const bool twice = std::all_of(paths.begin(), paths.end(), &Spool::CanBeReadTwice);
  if (wanted.empty() || !twice) return lines;
  const std::vector<std::string> files(paths.begin(), paths.end());
  auto source = files.size() > 1 ? capture::OpenJoined(files, &InterruptFlag())
                                 : capture::OpenCapture(files.front(), &InterruptFlag());
  if (!source) return lines;
  std::uint64_t line = 2;  // the first one holds the titles of the columns
  auto next = wanted.begin();
  capture::CapturedFrame frame;
  while (next != wanted.end() && !InterruptFlag() && (*source)->Next(frame) == capture::ReadStatus::kFrame) {
    const std::uint64_t own = LinesOf(wire::FrameView::Parse(frame));
    // A frame without a line of its own is told where it would stand.
    for (; next != wanted.end() && next->first <= frame.number; ++next) next->second = line;
    line += own;
  }
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (const auto found = wanted.find(findings[i].first.number); found != wanted.end()) lines[i] = found->second;
  }
  return lines;
}

}  // namespace ecaudit::cli
