/// What another capture should hold, so that what could not be evaluated in this one can be.
#pragma once

#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/coverage.h"

namespace ecaudit {

/// From the coverage and the lines of `result`: the shortest way to know, what opens most rules first. Empty when
/// nothing is open that a capture could show.
[[nodiscard]] std::vector<CaptureAdvice> WhatToCaptureNext(const AnalysisResult& result);

}  // namespace ecaudit
