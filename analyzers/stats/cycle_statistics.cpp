#include "analyzers/stats/cycle_statistics.h"

#include <algorithm>
#include <cmath>

namespace ecaudit {

void CycleStatistics::On(const track::LogicalAccess& access) {
  // The outbound copy is stamped closest to the master's cycle.
  const FrameRef& frame = access.sent.seen() ? access.sent : access.returned;
  if (!frame.has_time) return;
  for (Image& image : images_) {
    if (!image.used) {
      image.used = true;
      image.address = access.address;
      image.command = access.command;
      image.last = frame;
      return;
    }
    if (image.address != access.address || image.command != access.command) continue;
    if (frame.number == image.last.number) return;
    const auto interval = static_cast<double>(frame.time - image.last.time);
    image.last = frame;
    image.min_ns = image.intervals == 0 ? interval : std::min(image.min_ns, interval);
    image.max_ns = image.intervals == 0 ? interval : std::max(image.max_ns, interval);
    ++image.intervals;
    // Welford: numerically stable in one pass.
    const double delta = interval - image.mean_ns;
    image.mean_ns += delta / static_cast<double>(image.intervals);
    image.sum_of_squares += delta * (interval - image.mean_ns);
    return;
  }
}

CycleSummary CycleStatistics::Summary() const {
  const auto most = std::max_element(images_.begin(), images_.end(),
                                     [](const Image& a, const Image& b) { return a.intervals < b.intervals; });
  CycleSummary summary;
  if (most->intervals == 0) return summary;
  summary.cycles = most->intervals;
  summary.mean_us = most->mean_ns / 1e3;
  summary.min_us = most->min_ns / 1e3;
  summary.max_us = most->max_ns / 1e3;
  summary.stddev_us = std::sqrt(most->sum_of_squares / static_cast<double>(most->intervals)) / 1e3;
  summary.time_source = "capture";
  return summary;
}

}  // namespace ecaudit
