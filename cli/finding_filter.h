/// Leaves the findings that a command shows, each with its causes.
#pragma once

#include <vector>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::cli {

/// Marks in `wanted` the causes of what is wanted, and their causes.
void AddCauses(const std::vector<Finding>& findings, std::vector<bool>& wanted);
/// Removes what is not wanted, and brings the rest into the order of reports. Whatever names a finding by its place
/// follows: causes, and the rungs of ladders. A rung whose finding is removed names none.
void KeepFindings(const std::vector<bool>& wanted, AnalysisResult& result);

}  // namespace ecaudit::cli
