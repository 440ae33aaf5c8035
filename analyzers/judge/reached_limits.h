/// Which stores of the analysis were full: what they left out has to be reported.
#pragma once

#include "analyzers/judge/crowded_lists.h"
#include "analyzers/judge/finding_store.h"
#include "analyzers/result/analysis_result.h"
#include "decoder/pipeline.h"

namespace ecaudit {

/// Fills AnalysisResult::limits and ::cut. The other parts of `result` are there already.
void AddLimits(const FindingStore& store, const Pipeline& pipeline, const CrowdedLists& lists, AnalysisResult& result);

}  // namespace ecaudit
