/// Two captures side by side: what differs in start-ups, configuration, timing and findings, the most important first.
///
/// Where only one of two start-ups of a slave is refused a state, the settings that its AL status code is about lead.
///
/// Slaves are matched by identity and position, whatever their addresses. What varies between two runs of the same
/// master (times, offsets, station addresses) is no difference.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/capture_diff.h"
#include "analyzers/result/setting_range.h"

namespace ecaudit::diff {

/// What a comparison needs of those who know rules and codes.
struct Knowledge {
  std::function<std::string(const Finding&)> title;  ///< words for a finding; they are compared by their identity
  /// The settings that the refusal of a state with this AL status code (0: not read) is about; may be empty.
  std::function<std::vector<SettingRange>(std::uint16_t code, std::uint8_t requested)> settings;
};

/// The result refers into `a` and `b`.
[[nodiscard]] CaptureDiff Compare(const AnalysisResult& a, const AnalysisResult& b, const Knowledge& knowledge);

}  // namespace ecaudit::diff
