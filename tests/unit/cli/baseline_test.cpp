#include "cli/baseline.h"

#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"
#include "tests/unit/cli/temp_dir.h"

namespace ecaudit::cli {
namespace {

using report::WithoutCounts;
using test::Frame;
using test::MakeFinding;
using test::OneReport;
using test::RefusedSafeop;
using test::TempDir;

TEST(Baseline, WhatIsWrittenIsKnownNextTime) {
  const TempDir dir;
  const std::string path = dir.Write("known.json", WriteBaseline(OneReport(RefusedSafeop())));
  const auto baseline = ReadBaseline(path);
  ASSERT_TRUE(baseline) << baseline.error().message;

  // The same fault elsewhere in another capture, and a new one.
  report::CaptureReport later = RefusedSafeop();
  later.result.findings[0].first = Frame(12345);
  later.result.findings[0].count = 1;
  later.result.findings.push_back(MakeFinding("sdo-abort", Severity::kError, 7, 20));
  ApplyBaseline(*baseline, later);
  EXPECT_TRUE(later.IsKnown(0));
  EXPECT_FALSE(later.IsKnown(1));
}

TEST(Baseline, NumbersThatCountAreNotCompared) {
  EXPECT_EQ(WithoutCounts("4 frames of 1,810 never came back"), "# frames of # never came back");
  EXPECT_EQ(WithoutCounts("Mode of operation 9 is not in the manual's list"),
            "Mode of operation 9 is not in the manual's list");
  EXPECT_EQ(WithoutCounts("Slaves on the bus: 3 before, 2 now"), "Slaves on the bus: # before, # now");
  EXPECT_EQ(WithoutCounts("PREOP not reached within 3.000 s, no error"), "PREOP not reached within # s, no error");
  EXPECT_EQ(WithoutCounts("file ends inside packet 332"), "file ends inside packet #");
}

TEST(Baseline, NumbersThatNameSomethingAre) {
  for (const std::string_view title :
       {"Counter rises: invalid frames at port 1", "AL Control 0x0005 requests state 5, which does not exist",
        "SAFEOP refused with AL status code 0x001d", "SM2 disagrees with 1C12h:1", "", " two  spaces ", "F125"}) {
    EXPECT_EQ(WithoutCounts(title), title);
  }
}

TEST(Baseline, AnotherSlaveOrCodeIsNew) {
  const Baseline baseline{{FingerprintOf(RefusedSafeop().result.findings[0], RefusedSafeop().result), {}}};
  report::CaptureReport other_slave = RefusedSafeop();
  other_slave.result.slaves[0].position = 1;
  ApplyBaseline(baseline, other_slave);
  EXPECT_FALSE(other_slave.IsKnown(0));

  report::CaptureReport other_code = RefusedSafeop();
  other_code.result.findings[0].title = "SAFEOP refused with AL status code 0x001e";
  ApplyBaseline(baseline, other_code);
  EXPECT_FALSE(other_code.IsKnown(0));
}

TEST(Baseline, ReasonsStayAndDaysEnd) {
  const TempDir dir;
  const auto with = [&dir](const std::string& more) {
    return dir.Write("b.json", R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "al-refused", "slave": 0, )"
                               R"("title": "SAFEOP refused with AL status code 0x001d")" +
                                   more + "}]}");
  };
  report::CaptureReport capture = RefusedSafeop();
  auto baseline = ReadBaseline(with(R"(, "reason": "spare axis", "expires": "2999-12-31")"));
  ASSERT_TRUE(baseline) << baseline.error().message;
  ApplyBaseline(*baseline, capture);
  EXPECT_TRUE(capture.IsKnown(0));
  EXPECT_EQ(capture.WhyKnown(0), "spare axis; until 2999-12-31");
  const std::string again = WriteBaseline(OneReport(capture), *baseline);
  EXPECT_NE(again.find("\"reason\": \"spare axis\""), std::string::npos);
  EXPECT_NE(again.find("\"expires\": \"2999-12-31\""), std::string::npos);

  baseline = ReadBaseline(with(R"(, "reason": "until the repair", "expires": "2019-05-01")"));
  ASSERT_TRUE(baseline);
  ApplyBaseline(*baseline, capture);
  EXPECT_FALSE(capture.IsKnown(0));
  EXPECT_EQ(capture.WhyKnown(0), "");
  ASSERT_EQ(ExpiredEntries(*baseline).size(), 1U);
  EXPECT_NE(ExpiredEntries(*baseline)[0].find("al-refused of slave 0 was accepted until 2019-05-01 only"),
            std::string::npos);
  const std::string anew = WriteBaseline(OneReport(capture), *baseline);
  EXPECT_NE(anew.find("until the repair"), std::string::npos);
  EXPECT_EQ(anew.find("expires"), std::string::npos);

  for (const char* wrong :
       {R"(, "reason": 1)", R"(, "expires": "tomorrow")", R"(, "expires": "2026-12-31T12:00")", R"(, "why": "x")"}) {
    EXPECT_FALSE(ReadBaseline(with(wrong))) << wrong;
  }
}

TEST(Baseline, FindingsOfTheWholeBus) {
  report::CaptureReport capture = RefusedSafeop();
  capture.result.findings[0].slave = kNoSlave;
  const TempDir dir;
  const auto baseline = ReadBaseline(dir.Write("b.json", WriteBaseline(OneReport(capture))));
  ASSERT_TRUE(baseline);
  ApplyBaseline(*baseline, capture);
  EXPECT_TRUE(capture.IsKnown(0));
}

TEST(Baseline, OtherFilesAreRefused) {
  const TempDir dir;
  for (const std::string_view content :
       {"[]", "{}", R"({"schema": "ecaudit.report/1", "findings": []})", R"({"schema": "ecaudit.baseline/1"})",
        R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "a", "slave": 0}]})",
        R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "a", "slave": -1, "title": "t"}]})",
        R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "a", "slave": 70000, "title": "t"}]})",
        R"({"schema": "ecaudit.baseline/1", "findings": ["a"]})", R"({"schema": 1, "findings": []})"}) {
    EXPECT_FALSE(ReadBaseline(dir.Write("b.json", content))) << content;
  }
  EXPECT_TRUE(ReadBaseline(dir.Write("b.json", R"({"schema": "ecaudit.baseline/1", "findings": []})")));
}

}  // namespace
}  // namespace ecaudit::cli
