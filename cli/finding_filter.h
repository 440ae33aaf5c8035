/// Leaves the findings that a command shows, each with its causes.
#pragma once

#include <vector>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::cli {

/// Marks in `wanted` the causes of what is wanted, and their causes.
void AddCauses(const std::vector<Finding>& findings, std::vector<bool>& wanted);
/// Removes what is not wanted; causes keep their places, and the order is that of reports.
void KeepFindings(const std::vector<bool>& wanted, std::vector<Finding>& findings);

}  // namespace ecaudit::cli
