/// The whole way from packets to reports, and what must hold whatever the packets are.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "cli/report/formats.h"
#include "cli/report/report.h"
#include "decoder/base/json.h"
#include "decoder/base/text.h"

namespace ecaudit::fuzz {

inline void Check(bool condition) {
  if (!condition) std::abort();
}

/// Nearly all lines of all reports are. Counting the ways through this loop would take a third of the time.
#ifdef __clang__
__attribute__((no_sanitize("coverage")))
#endif
inline bool
IsPlainAscii(std::string_view line) {
  for (const char c : line) {
    if (c < 0x20 || c == 0x7F) return false;
  }
  return true;
}

/// Nothing that controls a terminal, and valid UTF-8: Printable() would leave each line as it is.
inline void CheckLines(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    Check(IsPlainAscii(line) || Printable(line) == line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

/// Analyses `source` with all rules, and for every fourth size of the input writes a report, in the format that the
/// size chooses: writing takes as long as all the rest, and writing all formats three times as long.
/// @param other_records  at most so many records of the file have a frame number and are no packet
inline void AnalyseAndReport(capture::FrameSource& source, std::size_t input_bytes, std::uint64_t other_records = 0) {
  report::Report report;
  report.version = "fuzz";
  report.captures.emplace_back();
  AnalysisResult& result = report.captures.back().result;
  result = Analyse(source, {});

  Check(result.findings.size() <= 3 * (5000 + result.coverage.size()) &&
        result.not_evaluable.size() <= 1000 + result.coverage.size());
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    Check(FindRule(finding.rule) != nullptr);
    Check(finding.kind != nullptr && finding.count >= 1);
    Check(finding.caused_by == kNoFinding || finding.caused_by < result.findings.size());
    Check(finding.caused_by != i);
    Check(finding.first.number <= result.capture.packets + other_records || !finding.first.seen());
  }
  const auto& formats = report::Formats();
  if (input_bytes % 4 != 0) return;
  const report::Format& format = formats[input_bytes / 4 % formats.size()];
  const std::string text = format.write(report, {});
  // Annotations of findings, and nothing else.
  Check(!text.empty() || format.name == "github");
  CheckLines(text);
  if (format.name == "json") Check(ReadJson(text).document.has_value());
}

}  // namespace ecaudit::fuzz
