/// The order in which findings are read (analyzers/result/reading_order.h), without those that the baseline knows.
#pragma once

#include <vector>

#include "analyzers/result/reading_order.h"
#include "cli/report/digest.h"
#include "cli/report/report.h"

namespace ecaudit::report {

using OrderedFinding = ReadingEntry;  ///< `index` is the place in AnalysisResult::findings

[[nodiscard]] std::vector<OrderedFinding> OrderForReading(const CaptureReport& capture);
[[nodiscard]] std::vector<OrderedFinding> OrderForReading(const CaptureDigest& capture);

}  // namespace ecaudit::report
