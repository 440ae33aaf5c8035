/// How far slaves and axes got, a line for each; those that are alike share one.
#pragma once

#include <string>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "cli/report/layout.h"

namespace ecaudit::report {

struct ProgressLine {
  std::string label;     ///< "slave 0", "slaves 0-39", "axis 2"
  std::string text;      ///< "OP, in sync, enabled"
  bool of_axis = false;  ///< belongs to the slave above
};

[[nodiscard]] std::vector<ProgressLine> ProgressLines(const AnalysisResult& result);

/// The section "Progress", nothing where no slave has a ladder. Of many lines the first.
void WriteProgress(const AnalysisResult& result, TextBuilder& text);

}  // namespace ecaudit::report
