#include "cli/report/report.h"

#include <array>
#include <charconv>

#include "cli/report/coverage_tally.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {

bool Fails(Severity severity, bool holds, FailOn fail_on) {
  if (holds) return fail_on != FailOn::kNever;
  switch (fail_on) {
    case FailOn::kInfo:
      return true;
    case FailOn::kWarning:
      return severity != Severity::kInfo;
    case FailOn::kError:
      return severity == Severity::kError;
    case FailOn::kNever:
      return false;
  }
  return false;
}

std::string_view Name(FailOn fail_on) {
  static constexpr Named<FailOn> kNames[] = {
      {FailOn::kInfo, "info"},
      {FailOn::kWarning, "warning"},
      {FailOn::kError, "error"},
      {FailOn::kNever, "never"},
  };
  static_assert(NamesAll(kNames, FailOn::kNever));
  return NameIn(kNames, fail_on);
}

std::optional<FailOn> ParseFailOn(std::string_view text) {
  for (const FailOn f : {FailOn::kInfo, FailOn::kWarning, FailOn::kError, FailOn::kNever}) {
    if (Name(f) == text) return f;
  }
  return std::nullopt;
}

void Summary::Add(Severity severity, bool is_known, bool holds, FailOn fail_on) {
  if (is_known) {
    ++known;
    return;
  }
  ++(severity == Severity::kError ? errors : severity == Severity::kWarning ? warnings : infos);
  if (Fails(severity, holds, fail_on)) fail = true;
}

void Summary::Add(const Summary& other) {
  errors += other.errors;
  warnings += other.warnings;
  infos += other.infos;
  known += other.known;
  fail = fail || other.fail;
  judged = judged && other.judged;
  limited = limited || other.limited;
  unmet = unmet || other.unmet;
  incomplete = incomplete || other.incomplete;
}

std::string Text(const Selection& selection) {
  std::string text;
  const auto add = [&text](std::string_view option, const std::string& value) {
    text += (text.empty() ? "" : " ") + std::string(option) + " " + value;
  };
  // No digit below the nanosecond: a sum of two times would show what doubles cannot hold.
  const auto seconds = [](double value) {
    constexpr int kDigits = 9;
    std::array<char, 400> digits{};  // the longest double without exponent
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed, kDigits).ptr;
    std::string shown(digits.data(), end);
    shown.erase(shown.find_last_not_of('0') + 1);
    if (shown.ends_with('.')) shown.pop_back();
    return shown;
  };
  for (const std::string& slave : selection.slaves) add("--slave", slave);
  for (const std::uint16_t interface : selection.interfaces) add("--interface", std::to_string(interface));
  if (selection.from_s) add("--from", seconds(*selection.from_s));
  if (selection.from_frame) add("--from", "#" + std::to_string(*selection.from_frame));
  if (selection.to_s) add("--to", seconds(*selection.to_s));
  if (selection.to_frame) add("--to", "#" + std::to_string(*selection.to_frame));
  return text;
}

std::string OutsideText(const Selection& selection) {
  const OutsideWindow& outside = selection.outside;
  std::string counts;
  const auto add = [&counts](std::uint64_t count, std::string_view noun) {
    if (count > 0) counts += (counts.empty() ? "" : ", ") + Count(count, noun);
  };
  add(outside.errors, "error");
  add(outside.warnings, "warning");
  add(outside.infos, "info");
  return counts;
}

std::string LimitsText(const Selection& selection) {
  std::string text = Text(selection);
  if (selection.range() && !selection.isolated_by.empty()) {
    text += "; packets outside it were not evaluated (" + selection.isolated_by + ")";
  }
  if (const std::string counts = OutsideText(selection); !counts.empty()) text += "; outside it: " + counts;
  return text;
}

Summary Summarise(const CaptureReport& capture) {
  Summary summary;
  summary.judged = capture.judged;
  summary.limited = capture.judged && !WhyLimited(capture.result).empty();
  summary.unmet = !capture.unmet.empty();
  for (std::size_t i = 0; i < capture.result.findings.size(); ++i) {
    const Finding& finding = capture.result.findings[i];
    summary.Add(finding.severity, capture.IsKnown(i), !finding.holds.empty(), capture.fail_on);
  }
  return summary;
}

Summary Summarise(const Report& report) {
  Summary sum;
  for (const CaptureReport& capture : report.captures) sum.Add(Summarise(capture));
  sum.incomplete = !report.unreadable.empty();
  return sum;
}

bool WithoutEtherCat(const AnalysisResult& result) {
  return result.capture.ethercat_frames == 0 && result.capture.malformed_frames == 0 &&
         result.capture.cut_frames == 0 && result.capture.crc_error_frames == 0;
}

}  // namespace ecaudit::report
