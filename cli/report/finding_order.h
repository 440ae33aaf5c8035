/// The order in which a person reads findings: worst first, each cause before its consequences.
#pragma once

#include <vector>

#include "cli/report/digest.h"
#include "cli/report/report.h"

namespace ecaudit::report {

struct OrderedFinding {
  std::size_t index = 0;  ///< in AnalysisResult::findings
  int depth = 0;          ///< 0: a cause of its own; n: consequence of the nearest finding above with depth n - 1
};

/// All findings that are not known. Roots stand by the worst severity among them and their consequences, then by frame.
[[nodiscard]] std::vector<OrderedFinding> OrderForReading(const CaptureReport& capture);
[[nodiscard]] std::vector<OrderedFinding> OrderForReading(const CaptureDigest& capture);

}  // namespace ecaudit::report
