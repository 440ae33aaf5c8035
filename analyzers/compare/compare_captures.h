/// Two captures side by side: what differs in start-ups, configuration, timing and findings, the most telling first.
///
/// Slaves are matched by identity and position, whatever their addresses. What varies between two runs of the same
/// master (times, offsets, station addresses) is no difference.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/capture_diff.h"

namespace ecaudit::diff {

/// @param title  makes titles of findings comparable: counts and the like taken out
/// The result refers into `a` and `b`.
[[nodiscard]] CaptureDiff Compare(const AnalysisResult& a, const AnalysisResult& b,
                                  const std::function<std::string(std::string_view)>& title);

}  // namespace ecaudit::diff
