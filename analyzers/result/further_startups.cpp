#include "analyzers/result/further_startups.h"

#include <algorithm>

namespace ecaudit::startup {

FrameNo NextStartup(const AnalysisResult& result) {
  FrameNo again = 0;
  FrameNo end = 0;  // of the start-ups that are kept
  for (const SlaveSummary& slave : result.slaves) {
    end = std::max(end, slave.startup.end.number);
    const FrameNo frame = slave.startup.again_frame.number;
    // Where a later attempt is the one that is kept, those before it failed.
    if (slave.startup.again == 0 || frame <= slave.startup.end.number) continue;
    again = again == 0 ? frame : std::min(again, frame);
  }
  FrameNo next = again;
  for (const RunSummary& run : result.bus.runs) {
    if (run.first.number > end && run.first.number <= again) next = run.first.number;
  }
  return next;
}

}  // namespace ecaudit::startup
