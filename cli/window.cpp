#include "cli/window.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "cli/finding_filter.h"

namespace ecaudit::cli {

capture::ReadStatus WindowSource::Next(capture::CapturedFrame& frame) noexcept {
  const capture::ReadStatus status = source_->Next(frame);
  if (status != capture::ReadStatus::kFrame) return status;
  if (!has_origin_ && frame.has_time) {
    has_origin_ = true;
    origin_ = frame.time;
  }
  std::optional<double> seconds;
  std::int64_t ns = 0;
  if (frame.has_time && !__builtin_sub_overflow(frame.time, origin_, &ns)) seconds = static_cast<double>(ns) / 1e9;
  if (!range_.Contains(frame.number, seconds)) return status;
  if (first_ == 0) first_ = frame.number;
  last_ = std::max(last_, frame.number);
  return status;
}

bool Touches(const Finding& finding, FrameNo first, FrameNo last) {
  const auto inside = [&](FrameNo frame) { return frame >= first && frame <= last; };
  const FrameNo begin = finding.first.number;
  const FrameNo end = std::max({begin, finding.last.number, finding.until});
  if (begin == 0 && finding.related_frames.empty()) return true;
  if (begin != 0 && begin <= last && end >= first) return true;
  return std::ranges::any_of(finding.related_frames, inside);
}

report::OutsideWindow KeepWindow(FrameNo first, FrameNo last, AnalysisResult& result) {
  const std::vector<Finding>& findings = result.findings;
  std::vector<bool> wanted(findings.size());
  for (std::size_t i = 0; i < findings.size(); ++i) wanted[i] = Touches(findings[i], first, last);
  AddCauses(findings, wanted);
  report::OutsideWindow outside;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (wanted[i]) continue;
    const Severity severity = findings[i].severity;
    ++(severity == Severity::kError     ? outside.errors
       : severity == Severity::kWarning ? outside.warnings
                                        : outside.infos);
  }
  KeepFindings(wanted, result);
  return outside;
}

}  // namespace ecaudit::cli
