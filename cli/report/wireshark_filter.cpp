#include "cli/report/wireshark_filter.h"

#include <algorithm>
#include <vector>

namespace ecaudit::report {

std::string WiresharkFilter(const Finding& finding) {
  std::vector<FrameNo> frames;
  const auto add = [&frames](FrameNo frame) {
    if (frame != 0 && std::ranges::find(frames, frame) == frames.end()) frames.push_back(frame);
  };
  add(finding.first.number);
  add(finding.last.number);
  for (const FrameNo frame : finding.related_frames) add(frame);

  std::string filter;
  for (const FrameNo frame : frames) {
    if (!filter.empty()) filter += " || ";
    filter += "frame.number==" + std::to_string(frame);
  }
  return filter;
}

}  // namespace ecaudit::report
