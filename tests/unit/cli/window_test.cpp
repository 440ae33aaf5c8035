#include "cli/window.h"

#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::cli {
namespace {

using test::MakeFinding;

TEST(Window, AFindingTouchesItByAnyOfItsFrames) {
  Finding finding = MakeFinding("rule", Severity::kError, 1, 100);
  EXPECT_TRUE(Touches(finding, 100, 100));
  EXPECT_TRUE(Touches(finding, 1, 100));
  EXPECT_FALSE(Touches(finding, 101, 200));
  finding.related_frames = {150};
  EXPECT_TRUE(Touches(finding, 150, 160));
  EXPECT_FALSE(Touches(finding, 101, 149)) << "related frames are single frames";
  finding.last = test::Frame(300);
  EXPECT_TRUE(Touches(finding, 200, 210)) << "a repetition may lie there";
  EXPECT_FALSE(Touches(finding, 301, 310));
}

TEST(Window, AFindingWithoutAFrameIsAboutTheWholeCapture) {
  Finding finding = MakeFinding("rule", Severity::kError, 1, 0);
  finding.first = finding.last = {};
  EXPECT_TRUE(Touches(finding, 5, 6));
  finding.related_frames = {9};
  EXPECT_FALSE(Touches(finding, 5, 6));
}

TEST(Window, KeepsCausesAndCountsTheRest) {
  AnalysisResult result;
  result.findings = {MakeFinding("cause", Severity::kInfo, 1, 10), MakeFinding("early", Severity::kError, 1, 20),
                     MakeFinding("inside", Severity::kError, 1, 100, 0),
                     MakeFinding("late", Severity::kWarning, 1, 200), MakeFinding("later", Severity::kInfo, 1, 300)};
  EXPECT_EQ(KeepWindow(90, 110, result), (report::OutsideWindow{1, 1, 1}));
  ASSERT_EQ(result.findings.size(), 2U);
  for (const Finding& finding : result.findings) {
    if (finding.rule == "inside") EXPECT_EQ(result.findings[finding.caused_by].rule, "cause");
  }
}

}  // namespace
}  // namespace ecaudit::cli
