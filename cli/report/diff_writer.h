/// Two captures side by side, for a person and for programs (ecaudit.diff/1).
#pragma once

#include <string>

#include "analyzers/result/capture_diff.h"
#include "cli/report/text_writer.h"

namespace ecaudit::report {

/// Both results must be the ones that `diff` compares.
struct DiffReport {
  std::string version;  ///< of the program
  const AnalysisResult& a;
  const AnalysisResult& b;
  const diff::CaptureDiff& diff;
  bool all = false;  ///< text: also what a refusal is not about
};

/// The most important differences are in the first lines.
[[nodiscard]] std::string WriteDiffText(const DiffReport& report, const TextStyle& style);
[[nodiscard]] std::string WriteDiffJson(const DiffReport& report);

}  // namespace ecaudit::report
