/// Two captures side by side: what differs in start-ups, configuration, timing and findings, the most important first.
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

/// @param title  words for a finding; findings are compared by their identity
/// The result refers into `a` and `b`.
[[nodiscard]] CaptureDiff Compare(const AnalysisResult& a, const AnalysisResult& b,
                                  const std::function<std::string(const Finding&)>& title);

}  // namespace ecaudit::diff
