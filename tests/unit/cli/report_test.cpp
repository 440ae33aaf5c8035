#include "cli/report/report.h"

#include <gtest/gtest.h>

#include "cli/report/formats.h"
#include "cli/report/wireshark_filter.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::Frame;
using test::MakeFinding;

CaptureReport OneOfEach() {
  CaptureReport capture;
  capture.result.findings = {MakeFinding("a", Severity::kInfo, 0, 1), MakeFinding("b", Severity::kError, 0, 2),
                             MakeFinding("c", Severity::kWarning, 0, 3)};
  return capture;
}

TEST(Report, CountsBySeverity) {
  const Summary s = Summarise(OneOfEach());
  EXPECT_EQ(s.errors, 1U);
  EXPECT_EQ(s.warnings, 1U);
  EXPECT_EQ(s.infos, 1U);
  EXPECT_EQ(s.known, 0U);
}

TEST(Report, VerdictFollowsFailOn) {
  const auto fails = [](std::vector<bool> known, FailOn fail_on) {
    CaptureReport capture = OneOfEach();
    capture.known = std::move(known);
    capture.fail_on = fail_on;
    return Summarise(capture).fail;
  };
  EXPECT_TRUE(fails({}, FailOn::kError));
  EXPECT_FALSE(fails({}, FailOn::kNever));
  EXPECT_FALSE(fails({false, true, false}, FailOn::kError));
  EXPECT_TRUE(fails({false, true, false}, FailOn::kWarning));
  EXPECT_FALSE(fails({false, true, true}, FailOn::kWarning));
  EXPECT_TRUE(fails({false, true, true}, FailOn::kInfo));
  EXPECT_FALSE(fails({true, true, true}, FailOn::kInfo));
}

TEST(Report, SumFailsWhenOneCaptureDoes) {
  Report report;
  report.captures.resize(2);
  EXPECT_FALSE(Summarise(report).fail);
  report.captures[1] = OneOfEach();
  EXPECT_TRUE(Summarise(report).fail);
  EXPECT_EQ(Summarise(report).errors, 1U);
}

TEST(Report, FailOnNames) {
  for (const FailOn f : {FailOn::kInfo, FailOn::kWarning, FailOn::kError, FailOn::kNever}) {
    EXPECT_EQ(ParseFailOn(Name(f)), f);
  }
  EXPECT_EQ(ParseFailOn("errors"), std::nullopt);
}

TEST(Report, BrokenFramesAreEtherCatToo) {
  AnalysisResult result;
  EXPECT_TRUE(WithoutEtherCat(result));
  result.capture.malformed_frames = 1;
  EXPECT_FALSE(WithoutEtherCat(result));
}

TEST(WiresharkFilter, OneFrame) {
  EXPECT_EQ(WiresharkFilter(MakeFinding("a", Severity::kError, 0, 760)), "frame.number==760");
}

TEST(WiresharkFilter, EachFrameOnce) {
  Finding finding = MakeFinding("a", Severity::kError, 0, 760);
  finding.last = Frame(900);
  finding.related_frames = {743, 760, 0};
  EXPECT_EQ(WiresharkFilter(finding), "frame.number==760 || frame.number==900 || frame.number==743");
}

TEST(WiresharkFilter, NoFrame) {
  EXPECT_EQ(WiresharkFilter(Finding{}), "");
}

}  // namespace
}  // namespace ecaudit::report
