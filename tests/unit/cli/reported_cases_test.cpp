// The traces of tests/reports/: the first line of the report names the cause, and the mended capture is clean.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/layout.h"
#include "cli/report/report.h"
#include "cli/report/sentences.h"
#include "cli/report/text_writer.h"
#include "tests/support/folders.h"
#include "tests/support/trace_builder.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

const fs::path kReports = fs::path(test::SourceDir()) / "tests" / "reports";

struct ReportedCase {
  fs::path trace;
  std::string words;  ///< of the first line
};

std::string Trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? std::string() : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::vector<ReportedCase> AllCases() {
  std::vector<ReportedCase> cases;
  if (!fs::exists(kReports)) return cases;
  for (const auto& entry : fs::directory_iterator(kReports)) {
    if (entry.path().extension() != ".txt") continue;
    std::ifstream lines(entry.path());
    for (std::string line; std::getline(lines, line);) {
      const std::size_t bar = line.find('|');
      if (bar == std::string::npos) continue;
      const fs::path folder = fs::path(entry.path()).replace_extension();
      cases.push_back({folder / (Trimmed(line.substr(0, bar)) + ".trace"), Trimmed(line.substr(bar + 1))});
    }
  }
  std::sort(cases.begin(), cases.end(), [](const auto& a, const auto& b) { return a.trace < b.trace; });
  return cases;
}

CaptureReport ReportOf(const fs::path& path) {
  CaptureReport report;
  const auto trace = test::Trace::Load(path.string());
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return report;
  }
  report.result = Analyse(*trace->Source(), {});
  report.result.capture.file.path = path.stem().string() + ".pcapng";
  return report;
}

class ReportedCases : public ::testing::TestWithParam<ReportedCase> {};

TEST_P(ReportedCases, FirstLineNamesTheCause) {
  std::string source;
  std::ifstream file(GetParam().trace);
  std::getline(file, source);
  EXPECT_THAT(source, StartsWith("# https://"));
  const std::string text = WriteText(test::OneReport(ReportOf(GetParam().trace)), {});
  EXPECT_THAT(text.substr(0, text.find('\n')), HasSubstr(GetParam().words));
}

TEST_P(ReportedCases, MendedCaptureIsClean) {
  const fs::path mended = GetParam().trace.parent_path() / (GetParam().trace.stem().string() + "-mended.trace");
  ASSERT_TRUE(fs::exists(mended)) << mended;
  const CaptureReport report = ReportOf(mended);
  for (const Finding& finding : report.result.findings) {
    EXPECT_EQ(finding.severity, Severity::kInfo) << finding.rule << ": " << TitleOf(finding);
  }
  EXPECT_THAT(Headline(report), StartsWith("PASS"));
}

TEST(ReportedCaseFiles, EveryTraceIsListed) {
  std::vector<fs::path> listed;
  for (const ReportedCase& c : AllCases()) listed.push_back(c.trace);
  for (const auto& entry : fs::recursive_directory_iterator(kReports)) {
    std::string name = entry.path().string();
    if (entry.path().extension() != ".trace") continue;
    if (const std::size_t mended = name.find("-mended.trace"); mended != std::string::npos) name.erase(mended, 7);
    EXPECT_THAT(listed, testing::Contains(fs::path(name))) << entry.path();
  }
}

INSTANTIATE_TEST_SUITE_P(Reports, ReportedCases, ::testing::ValuesIn(AllCases()), [](const auto& info) {
  std::string name = info.param.trace.parent_path().filename().string() + "_" + info.param.trace.stem().string();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace ecaudit::report
