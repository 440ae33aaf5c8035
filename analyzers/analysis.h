/// Runs one capture through decoder, slave models and rules.
#pragma once

#include "analyzers/options/options.h"
#include "analyzers/result/analysis_result.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit {

struct Timeline;

/// Reads `source` to its end. Never fails: damage is a finding.
/// Profile and rule names in `options` must exist (see FindRule(), device::BuiltinProfileNames()).
/// @param timeline  receives what a report draws over time, collected in the same pass (process data are read once
/// more,
///                  which takes longer); null: nothing is drawn
AnalysisResult Analyse(capture::FrameSource& source, const AnalysisOptions& options, Timeline* timeline = nullptr);

}  // namespace ecaudit
