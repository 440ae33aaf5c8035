/// What the writers receive: plain data, complete, without text formatting.
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/rule_info.h"
#include "analyzers/result/timeline.h"

namespace ecaudit::report {

/// The least severity that makes the verdict "fail".
enum class FailOn : std::uint8_t { kInfo, kWarning, kError, kNever };

[[nodiscard]] std::string_view Name(FailOn fail_on);
/// Reads what Name() writes; nothing for any other text.
[[nodiscard]] std::optional<FailOn> ParseFailOn(std::string_view text);

/// Findings that do not touch the window of a report.
struct OutsideWindow {
  std::uint64_t errors = 0, warnings = 0, infos = 0;

  auto operator<=>(const OutsideWindow&) const = default;
};

/// Which part of a capture is shown, or was examined.
struct Selection {
  std::optional<double> from_s, to_s;  ///< seconds from the first packet
  std::optional<FrameNo> from_frame, to_frame;
  std::vector<std::string> slaves;        ///< positions "0" or addresses "0x1001"; empty: all
  std::vector<std::uint16_t> interfaces;  ///< whose packets were read; empty: of all
  std::string isolated_by = {};  ///< option or command that evaluated the range alone; empty: all was evaluated
  OutsideWindow outside = {};    ///< evaluated and not shown

  [[nodiscard]] bool range() const { return from_s || to_s || from_frame || to_frame; }
  /// Packets are left out.
  [[nodiscard]] bool leaves_out() const { return range() || !interfaces.empty(); }
  auto operator<=>(const Selection&) const = default;
};
/// As it is typed: "--slave 0 --to #100"; empty for whole captures.
[[nodiscard]] std::string Text(const Selection& selection);
/// The same, with what lies outside: "--to #100; outside it: 1 error".
[[nodiscard]] std::string LimitsText(const Selection& selection);
/// "1 error, 2 warnings"; empty: nothing was evaluated that is not shown, or nothing was found.
[[nodiscard]] std::string OutsideText(const Selection& selection);

/// One capture's result and how it is to be evaluated.
struct CaptureReport {
  AnalysisResult result;
  std::shared_ptr<const Timeline> timeline;  ///< null: nothing to draw over time
  /// Per finding of `result`: true when the baseline lists it. Empty: no baseline.
  std::vector<bool> known;
  std::vector<std::string> known_because;  ///< likewise, what the baseline states of it
  /// Per finding: the line of its first frame in the text of `decode`, 0 where it has none. Empty: not counted.
  std::vector<std::uint64_t> decode_lines;
  Selection selection;
  bool judged = true;  ///< false: the start-up is shown, and there is no verdict
  FailOn fail_on = FailOn::kError;
  std::string config;                                      ///< path of the configuration file used; empty when none
  std::string baseline;                                    ///< path of the baseline used; empty when none
  std::vector<std::pair<std::string, std::string>> rules;  ///< settings that differ from the catalogue: id and
                                                           ///< severity, or "off"; sorted by id
  /// Path of the expectation that the start-up was compared with; empty when none. Then `result` holds the findings of
  /// that comparison only, and these count the others.
  std::string expectation;
  std::string required;            ///< as in --require; empty: nothing
  std::vector<std::string> unmet;  ///< what of it is missing, each a sentence without a full stop
  std::uint64_t other_errors = 0, other_warnings = 0;

  [[nodiscard]] bool IsKnown(std::size_t finding) const { return finding < known.size() && known[finding]; }
  [[nodiscard]] std::string_view WhyKnown(std::size_t finding) const {
    return finding < known_because.size() ? std::string_view(known_because[finding]) : std::string_view();
  }
};

/// A capture of which there is no result.
struct UnreadableCapture {
  std::string path;
  std::string message;  ///< why, one line
};

/// What a report was made from, to decide whether it must be made again.
struct Origin {
  std::string settings;     ///< hash of program and settings; empty: not recorded
  std::uint64_t bytes = 0;  ///< size of the capture
  std::string modified;     ///< when it was last changed, ISO 8601 UTC

  bool operator==(const Origin&) const = default;
};

struct Report {
  std::string version;                     ///< of the program
  std::span<const RuleInfo* const> rules;  ///< the catalogue, sorted by id
  std::vector<CaptureReport> captures;
  std::vector<UnreadableCapture> unreadable;
  Origin origin;  ///< reports of `ecaudit batch`
};

/// Findings counted by severity. Known findings count only in `known`.
struct Summary {
  std::uint64_t errors = 0;
  std::uint64_t warnings = 0;
  std::uint64_t infos = 0;
  std::uint64_t known = 0;
  bool fail = false;        ///< a finding that is not known reaches fail_on
  bool judged = true;       ///< false: there is no verdict
  bool limited = false;     ///< nothing is known of some slave, or of all: see WhyLimited()
  bool unmet = false;       ///< something of --require is missing
  bool incomplete = false;  ///< of several captures: one could not be read

  /// "pass", "limited", "fail", "incomplete"; what is required does not change it.
  [[nodiscard]] std::string_view Verdict() const {
    return fail ? "fail" : incomplete ? "incomplete" : limited ? "limited" : "pass";
  }
  /// @param holds  something that the master wanted was not reached because of it
  void Add(Severity severity, bool is_known, bool holds, FailOn fail_on);
  void Add(const Summary& other);
};

/// True when the exit status is to be 1: the verdict is "fail", or something that is required is missing.
[[nodiscard]] inline bool Gates(const Summary& summary) {
  return summary.fail || summary.unmet;
}

/// True when a finding makes the verdict "fail": its severity reaches `fail_on`, or the master did not reach something
/// that it wanted because of it, at any severity.
[[nodiscard]] bool Fails(Severity severity, bool holds, FailOn fail_on);

[[nodiscard]] Summary Summarise(const CaptureReport& capture);
/// Sums over all captures; fails, or is limited, when one of them is.
[[nodiscard]] Summary Summarise(const Report& report);

/// True when there is nothing to evaluate: the capture holds no EtherCAT frame.
[[nodiscard]] bool WithoutEtherCat(const AnalysisResult& result);

}  // namespace ecaudit::report
