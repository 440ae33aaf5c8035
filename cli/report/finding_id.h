/// The name of a finding in reports, and for `slice --finding`.
#pragma once

#include <string>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::report {

/// "f3": counted in the whole capture, so that a report of a part of it uses the same names.
[[nodiscard]] inline std::string FindingId(const AnalysisResult& result, FindingIndex finding) {
  return "f" + std::to_string(result.NumberOf(finding));
}

}  // namespace ecaudit::report
