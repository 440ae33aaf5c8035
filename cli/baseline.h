/// Findings that are known and accepted: the baseline file. docs/configuration.md describes it for users.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "cli/report/digest.h"
#include "cli/report/fingerprint.h"
#include "cli/report/report.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

using report::Fingerprint;

[[nodiscard]] Fingerprint FingerprintOf(const Finding& finding, const AnalysisResult& result);

/// What the file states about a finding besides its identity.
struct Acceptance {
  std::string reason;     ///< why it is accepted; may be empty
  std::string expires;    ///< last day on which it is, "2026-12-31"; empty: for ever
  bool expired = false;   ///< that day is over (UTC): the finding counts again
  std::string title;      ///< for people; never compared
  bool by_title = false;  ///< an entry of a version that named findings by their titles: it fits nothing
  /// Machines where it is accepted: "vendor 0x0000006a, product 0x00414b44" of the slave, or of all slaves for a
  /// finding of the bus; "*": any. Empty: only `captures` decides.
  std::vector<std::string> devices;
  /// Patterns of capture names, which decide where the capture does not show the devices. Both empty: everywhere.
  std::vector<std::string> captures;
};

/// One finding may be accepted on several machines.
using Baseline = std::multimap<Fingerprint, Acceptance>;

[[nodiscard]] Result<Baseline> ReadBaseline(const std::string& path);
/// The file that lists all findings of `report`, each once, sorted.
/// @param before  the file that it replaces: reasons stay, days that are not over, and the entries of rules that did
///   not run
[[nodiscard]] std::string WriteBaseline(const report::Report& report, const Baseline& before = {});
[[nodiscard]] std::string WriteBaseline(const report::Digest& digest, const Baseline& before = {});
/// What stands in the baseline that is to be replaced; empty where there is none.
[[nodiscard]] Baseline BaselineBefore(const std::string& path);

/// A sentence for each entry that no longer applies or names no rule, and one for all that name a finding by its title.
[[nodiscard]] std::vector<std::string> ExpiredEntries(const Baseline& baseline);

/// Sentences about the entries that match no finding of `captures`: fixed, mistyped, or of another machine. Nothing is
/// known of an entry for a capture that could not be read or shows only a part of its findings, or of a rule that did
/// not run.
[[nodiscard]] std::vector<std::string> UnmatchedEntries(const Baseline& baseline,
                                                        std::span<const report::CaptureDigest* const> captures);

/// "night-2026-03-02_0007.pcapng" gives "night-*-*-*_*.pcapng": the names that the captures of one job have.
[[nodiscard]] std::string PatternOf(std::string_view capture);

/// What keeps --write-baseline from writing to `path`, besides what CheckOutputPath() asks: a file that is there and no
/// baseline.
[[nodiscard]] std::optional<Error> CheckBaselinePath(const std::string& path);

/// Fills `known` and `known_because` of `capture`.
void ApplyBaseline(const Baseline& baseline, report::CaptureReport& capture);
/// Sets `known` of each finding.
void ApplyBaseline(const Baseline& baseline, report::CaptureDigest& capture);

}  // namespace ecaudit::cli
