/// Start-ups in one capture after the one that is kept of each slave.
#pragma once

#include "analyzers/result/analysis_result.h"
#include "decoder/base/ids.h"

namespace ecaudit::startup {

/// The frame with which the master begins to start slaves again whose start-up was over: that of the scan before it,
/// where the capture separates the two runs, else the first request to a slave. 0: it does not.
[[nodiscard]] FrameNo NextStartup(const AnalysisResult& result);

}  // namespace ecaudit::startup
