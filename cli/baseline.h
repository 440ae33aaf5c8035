/// Findings that are known and accepted: the baseline file. docs/configuration.md describes it for users.
#pragma once

#include <compare>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/core/analysis_result.h"
#include "cli/report/report.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// What stays the same when the same fault is captured again: no frame numbers, times or counts.
struct Fingerprint {
  std::string rule;
  std::optional<SlavePos> slave;  ///< position; nothing for the whole bus
  std::string title;              ///< printable, counting numbers as '#'

  auto operator<=>(const Fingerprint&) const = default;
};

[[nodiscard]] Fingerprint FingerprintOf(const Finding& finding, const AnalysisResult& result);

using Baseline = std::set<Fingerprint>;

[[nodiscard]] Result<Baseline> ReadBaseline(const std::string& path);
/// The file that lists all findings of `report`, each once, sorted.
[[nodiscard]] std::string WriteBaseline(const report::Report& report);

/// `title` with each decimal number replaced by '#': "4 frames of 181 never came back" is the same fault as "7 frames
/// of 900 ...". Kept are numbers that name something: behind "port" or "state", and those inside words ("0x001d",
/// "SM2", "1C12h:1").
[[nodiscard]] std::string WithoutCounts(std::string_view title);

/// Fills `known` of `capture`.
void ApplyBaseline(const Baseline& baseline, report::CaptureReport& capture);

}  // namespace ecaudit::cli
