#include "cli/report/report.h"

namespace ecaudit::report {
namespace {

bool Reaches(Severity severity, FailOn fail_on) {
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

}  // namespace

std::string_view Name(FailOn fail_on) {
  switch (fail_on) {
    case FailOn::kInfo:
      return "info";
    case FailOn::kWarning:
      return "warning";
    case FailOn::kError:
      return "error";
    case FailOn::kNever:
      return "never";
  }
  return "never";
}

std::optional<FailOn> ParseFailOn(std::string_view text) {
  for (const FailOn f : {FailOn::kInfo, FailOn::kWarning, FailOn::kError, FailOn::kNever}) {
    if (Name(f) == text) return f;
  }
  return std::nullopt;
}

Summary Summarise(const CaptureReport& capture) {
  Summary summary;
  for (std::size_t i = 0; i < capture.result.findings.size(); ++i) {
    const Severity severity = capture.result.findings[i].severity;
    if (capture.IsKnown(i)) {
      ++summary.known;
      continue;
    }
    ++(severity == Severity::kError     ? summary.errors
       : severity == Severity::kWarning ? summary.warnings
                                        : summary.infos);
    if (Reaches(severity, capture.fail_on)) summary.fail = true;
  }
  return summary;
}

Summary Summarise(const Report& report) {
  Summary sum;
  for (const CaptureReport& capture : report.captures) {
    const Summary one = Summarise(capture);
    sum.errors += one.errors;
    sum.warnings += one.warnings;
    sum.infos += one.infos;
    sum.known += one.known;
    sum.fail = sum.fail || one.fail;
  }
  return sum;
}

bool WithoutEtherCat(const AnalysisResult& result) {
  return result.capture.ethercat_frames == 0 && result.capture.malformed_frames == 0 &&
         result.capture.cut_frames == 0 && result.capture.crc_error_frames == 0;
}

}  // namespace ecaudit::report
