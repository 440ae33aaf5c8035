/// Rungs that an expectation demands besides its steps: who enables a drive in the expectation wants it enabled.
#pragma once

#include <string>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/expectation.h"

namespace ecaudit::startup {

/// What was expected and is not reached although no finding of the start-up reports it, each a sentence without a full
/// stop. A capture that ends during the start-up of a slave does not show it.
[[nodiscard]] std::vector<std::string> RungsMissing(const Expectation& expectation, const AnalysisResult& result);

}  // namespace ecaudit::startup
