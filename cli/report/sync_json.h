/// The synchronisation sections of a report as JSON: "bus.cycle", "bus.dc" and "slaves[].dc".
#pragma once

#include <nlohmann/json.hpp>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::report {

[[nodiscard]] nlohmann::ordered_json CycleJson(const CycleSummary& cycle);
[[nodiscard]] nlohmann::ordered_json BusDcJson(const AnalysisResult& result);
/// slave.dc must be set.
[[nodiscard]] nlohmann::ordered_json DcJson(const AnalysisResult& result, const SlaveSummary& slave);

}  // namespace ecaudit::report
