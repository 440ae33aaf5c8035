/// How much of a capture was evaluated, counted: each rule once for a slave, rules about the bus once.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/coverage.h"

namespace ecaudit::report {

struct CoverageCount {
  std::uint64_t judged = 0, partly = 0, not_judged = 0, not_applicable = 0;

  void Add(Coverage coverage);
  void Add(const CoverageCount& other);
  /// Where there was something to evaluate.
  [[nodiscard]] std::uint64_t applicable() const { return judged + partly + not_judged; }
  auto operator<=>(const CoverageCount&) const = default;
};

[[nodiscard]] CoverageCount CountOf(const RuleCoverage& rule);
[[nodiscard]] CoverageCount CountOf(std::span<const RuleCoverage> rules);

/// Evaluations that the user switched off, and that would apply otherwise.
[[nodiscard]] std::uint64_t CountSwitchedOff(std::span<const RuleCoverage> rules);

struct ChapterCoverage {
  std::string_view chapter;
  CoverageCount count;
};
/// In the order of the catalogue.
[[nodiscard]] std::vector<ChapterCoverage> ByChapter(std::span<const RuleCoverage> rules);

/// "judged", "partly", "not_judged", "not_applicable", as in the JSON report.
[[nodiscard]] std::string_view Name(Coverage coverage);

/// Why a rule does not apply: for the first slave to which it does not. Empty when it applies to all.
[[nodiscard]] std::string_view WhyNotApplicable(const RuleCoverage& rule);

/// The counts by chapter as one paragraph: "45 of 52 evaluated (3 more partly): Capture 4/4, ...; nothing to evaluate:
/// Latch, Start-up". Empty when nothing was counted.
[[nodiscard]] std::string CoverageText(std::span<const RuleCoverage> rules);

/// How many checks one missing thing keeps from being made.
struct MissingCount {
  std::string what;  ///< "the status word (6041h)"; a whole reason where it is not that a thing is not in the capture
  std::uint64_t checks = 0;
};
/// Over all that was not evaluated, the most checks first.
[[nodiscard]] std::vector<MissingCount> WhatIsMissing(const AnalysisResult& result);

/// "43 of 76 checks that concern this bus, 1 more in part; for 32 the capture does not show enough (the status word
/// (6041h): 13, the mapping of the outputs: 10, other: 9)". Empty when nothing applies.
[[nodiscard]] std::string CoverageSentence(const AnalysisResult& result);

/// Below this share of what applies, no one may take a capture for checked.
inline constexpr std::uint64_t kLeastJudgedPercent = 50;
/// Whether `percent` of what applies was evaluated in full; true when nothing applies.
[[nodiscard]] bool IsJudged(const CoverageCount& count, std::uint64_t percent);

/// What keeps a verdict without errors from being the whole truth.
struct Reservation {
  std::string text;   ///< "the capture misses packets", "only 5 of 142 evaluations were possible"
  std::string brief;  ///< the same for a line without room: "only 5 of 142 evaluated"
};
/// @param limited  the verdict shows already that little was evaluated
[[nodiscard]] std::vector<Reservation> Reservations(bool misses_packets, bool limited, const CoverageCount& count);
[[nodiscard]] std::vector<Reservation> Reservations(const AnalysisResult& result);
/// Their full texts.
[[nodiscard]] std::vector<std::string> TextsOf(const std::vector<Reservation>& reservations);

/// What makes a verdict "limited": no slave is known, or neither AL state nor process data of some; empty: nothing.
[[nodiscard]] std::string WhyLimited(const AnalysisResult& result);

}  // namespace ecaudit::report
