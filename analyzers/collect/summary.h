/// Puts what the stages counted into the plain data of a report.
#pragma once

#include "analyzers/observation.h"
#include "analyzers/result/analysis_result.h"

namespace ecaudit {

/// What the pipeline and the models know when the capture has ended; the collectors add their parts.
/// @param observation  of Depth::kClocks
[[nodiscard]] AnalysisResult Summarise(const capture::FrameSource& source, const Observation& observation);

}  // namespace ecaudit
