#include "cli/stream/frame_range.h"

#include <algorithm>
#include <charconv>
#include <string>

namespace ecaudit::cli {
namespace {

std::optional<FrameNo> FrameNumber(std::string_view text) {
  FrameNo value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || code != std::errc() || end != text.data() + text.size() || value == 0) return std::nullopt;
  return value;
}

std::optional<Error> Narrow(std::string_view text, FrameRange& range) {
  const std::size_t dash = text.find('-');
  const std::string_view first = text.substr(0, dash);
  const std::string_view last = dash == std::string_view::npos ? first : text.substr(dash + 1);
  const std::optional<FrameNo> from = FrameNumber(first);
  const std::optional<FrameNo> to = FrameNumber(last);
  if ((!from && !first.empty()) || (!to && !last.empty()) || (!from && !to)) {
    return Error{"--frames is '" + std::string(text) + "' but must be a frame number such as 760, or a range 743-800"};
  }
  if (from) range.from_frame = std::max(*from, range.from_frame.value_or(1));
  if (to) range.to_frame = std::min(*to, range.to_frame.value_or(*to));
  return std::nullopt;
}

}  // namespace

Result<FrameRange> ReadFrameRange(const AnalysisOptions& analysis, const std::optional<std::string>& frames) {
  FrameRange range{analysis.from_s, analysis.to_s, analysis.from_frame, analysis.to_frame};
  if (frames) {
    if (auto error = Narrow(*frames, range)) return *error;
  }
  if (range.from_frame && range.to_frame && *range.from_frame > *range.to_frame) {
    return Error{"the first frame to show is later than the last"};
  }
  return range;
}

}  // namespace ecaudit::cli
