/// Findings that are known and accepted: the baseline file. docs/configuration.md describes it for users.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "analyzers/result/analysis_result.h"
#include "cli/report/digest.h"
#include "cli/report/fingerprint.h"
#include "cli/report/report.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

using report::Fingerprint;

[[nodiscard]] Fingerprint FingerprintOf(const Finding& finding, const AnalysisResult& result);

using Baseline = std::set<Fingerprint>;

[[nodiscard]] Result<Baseline> ReadBaseline(const std::string& path);
/// The file that lists all findings of `report`, each once, sorted.
[[nodiscard]] std::string WriteBaseline(const report::Report& report);
[[nodiscard]] std::string WriteBaseline(const report::Digest& digest);

/// What keeps --write-baseline from writing to `path`, besides what CheckOutputPath() asks: a file that is there and no
/// baseline.
[[nodiscard]] std::optional<Error> CheckBaselinePath(const std::string& path);

/// Fills `known` of `capture`.
void ApplyBaseline(const Baseline& baseline, report::CaptureReport& capture);
/// Sets `known` of each finding.
void ApplyBaseline(const Baseline& baseline, report::CaptureDigest& capture);

}  // namespace ecaudit::cli
