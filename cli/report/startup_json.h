/// The start-up of one slave in the JSON report.
#pragma once

#include <nlohmann/json.hpp>

#include "cli/report/report.h"

namespace ecaudit::report {

/// Null when the capture shows nothing of it.
[[nodiscard]] nlohmann::ordered_json StartupJson(const AnalysisResult& result, const StartupSummary& startup);

}  // namespace ecaudit::report
