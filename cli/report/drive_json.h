/// The section "slaves[].drive" of a report as JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::report {

/// slave.drive must be set.
[[nodiscard]] nlohmann::ordered_json DriveJson(const AnalysisResult& result, const SlaveSummary& slave);

}  // namespace ecaudit::report
