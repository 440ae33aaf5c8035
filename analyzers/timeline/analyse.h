/// The analysis of analysis.h, with what a report draws over time.
#pragma once

#include "analyzers/analysis.h"
#include "analyzers/core/timeline.h"

namespace ecaudit {

/// As Analyse(), and collects `timeline` in the same pass; takes longer, since process data are read once more.
AnalysisResult AnalyseWithTimeline(capture::FrameSource& source, const AnalysisOptions& options, Timeline& timeline);

}  // namespace ecaudit
