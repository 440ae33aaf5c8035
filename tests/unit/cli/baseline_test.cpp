#include "cli/baseline.h"

#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"
#include "tests/unit/cli/temp_dir.h"

namespace ecaudit::cli {
namespace {

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

TEST(Baseline, OtherWordsForTheSameFindingFitStill) {
  const TempDir dir;
  report::CaptureReport before = RefusedSafeop();
  test::SetTexts(before.result.findings[0], "As version 0.1 put it", "", "refused requested=4");
  const auto baseline = ReadBaseline(dir.Write("known.json", WriteBaseline(OneReport(before))));
  ASSERT_TRUE(baseline) << baseline.error().message;
  report::CaptureReport later = RefusedSafeop();
  test::SetTexts(later.result.findings[0], "As version 0.2 puts it", "", "refused requested=4");
  ApplyBaseline(*baseline, later);
  EXPECT_TRUE(later.IsKnown(0));
}

TEST(Baseline, EntriesThatNameFindingsByTheirTitlesFitNothingAndAreReported) {
  const TempDir dir;
  const auto baseline = ReadBaseline(
      dir.Write("old.json", R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "al-refused", "slave": 0, )"
                            R"("title": "SAFEOP refused with AL status code 0x001d"}]})"));
  ASSERT_TRUE(baseline) << baseline.error().message;
  report::CaptureReport capture = RefusedSafeop();
  ApplyBaseline(*baseline, capture);
  EXPECT_FALSE(capture.IsKnown(0));
  ASSERT_EQ(ExpiredEntries(*baseline).size(), 1U);
  EXPECT_NE(ExpiredEntries(*baseline)[0].find("1 entry without an identity"), std::string::npos);
}

TEST(Baseline, AnotherSlaveOrCodeIsNew) {
  const Baseline baseline{{FingerprintOf(RefusedSafeop().result.findings[0], RefusedSafeop().result), {}}};
  report::CaptureReport other_slave = RefusedSafeop();
  other_slave.result.slaves[0].position = 1;
  ApplyBaseline(baseline, other_slave);
  EXPECT_FALSE(other_slave.IsKnown(0));

  report::CaptureReport other_code = RefusedSafeop();
  test::SetTexts(other_code.result.findings[0], "SAFEOP refused with AL status code 0x001e");
  ApplyBaseline(baseline, other_code);
  EXPECT_FALSE(other_code.IsKnown(0));
}

TEST(Baseline, ReasonsStayAndDaysEnd) {
  const TempDir dir;
  const auto with = [&dir](const std::string& more) {
    return dir.Write("b.json", R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "al-refused", "slave": 0, )"
                               R"("identity": "SAFEOP refused with AL status code 0x001d", "title": "in other words")" +
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
        R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "a", "slave": -1, "identity": "t"}]})",
        R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "a", "slave": 70000, "identity": "t"}]})",
        R"({"schema": "ecaudit.baseline/1", "findings": ["a"]})", R"({"schema": 1, "findings": []})"}) {
    EXPECT_FALSE(ReadBaseline(dir.Write("b.json", content))) << content;
  }
  EXPECT_TRUE(ReadBaseline(dir.Write("b.json", R"({"schema": "ecaudit.baseline/1", "findings": []})")));
}

}  // namespace
}  // namespace ecaudit::cli
