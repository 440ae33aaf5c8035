#include "cli/baseline.h"

#include <algorithm>
#include <array>

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

  for (const char* wrong : {R"(, "reason": 1)", R"(, "expires": "tomorrow")", R"(, "expires": "2026-12-31T12:00")",
                            R"(, "why": "x")", R"(, "devices": "any")", R"(, "captures": [1])"}) {
    EXPECT_FALSE(ReadBaseline(with(wrong))) << wrong;
  }
}

/// The same fault at the same position of another machine.
report::CaptureReport OnAnotherDevice() {
  report::CaptureReport capture = RefusedSafeop();
  capture.result.slaves[0].identity.product_code = 0x1234;
  return capture;
}

Baseline Reread(const std::string& text) {
  const TempDir dir;
  const auto baseline = ReadBaseline(dir.Write("b.json", text));
  EXPECT_TRUE(baseline) << baseline.error().message;
  return baseline ? *baseline : Baseline{};
}

bool IsKnown(const Baseline& baseline, report::CaptureReport capture) {
  ApplyBaseline(baseline, capture);
  const bool known = capture.IsKnown(0);
  // The digest, as batch and merge have it.
  report::CaptureDigest digest = DigestOf(capture);
  ApplyBaseline(baseline, digest);
  EXPECT_EQ(digest.findings[0].known, known);
  return known;
}

TEST(Baseline, OneMachineDoesNotHideTheFaultOfAnother) {
  const Baseline baseline = Reread(WriteBaseline(OneReport(RefusedSafeop())));
  EXPECT_TRUE(IsKnown(baseline, RefusedSafeop()));
  EXPECT_FALSE(IsKnown(baseline, OnAnotherDevice()));
  report::CaptureReport of_bus = RefusedSafeop();
  of_bus.result.findings[0].slave = kNoSlave;
  const Baseline bus = Reread(WriteBaseline(OneReport(of_bus)));
  EXPECT_TRUE(IsKnown(bus, of_bus));
  report::CaptureReport other_bus = OnAnotherDevice();
  other_bus.result.findings[0].slave = kNoSlave;
  EXPECT_FALSE(IsKnown(bus, other_bus));
}

TEST(Baseline, NamesDecideWhereTheDeviceIsNotInTheCapture) {
  report::CaptureReport capture = RefusedSafeop();
  capture.result.slaves[0].identity = {};
  capture.result.capture.file.path = "captures/press-2026-03-02_0007.pcapng";
  const Baseline baseline = Reread(WriteBaseline(OneReport(capture)));
  EXPECT_EQ(baseline.begin()->second.captures, std::vector<std::string>{"press-*-*-*_*.pcapng"});
  EXPECT_TRUE(IsKnown(baseline, capture));
  capture.result.capture.file.path = "elsewhere/press-2026-03-09_0001.pcapng";
  EXPECT_TRUE(IsKnown(baseline, capture));
  capture.result.capture.file.path = "captures/mill-2026-03-02_0007.pcapng";
  EXPECT_FALSE(IsKnown(baseline, capture));
  EXPECT_EQ(PatternOf("a/b[1]*.pcap"), "b\\[*]\\*.pcap");
}

TEST(Baseline, ToldOtherwiseItHoldsEverywhere) {
  Baseline baseline = Reread(WriteBaseline(OneReport(RefusedSafeop())));
  baseline.begin()->second.devices = {"*"};
  EXPECT_TRUE(IsKnown(baseline, OnAnotherDevice()));
  // And stays so in the file that replaces it, with one entry.
  const Baseline again = Reread(WriteBaseline(OneReport(OnAnotherDevice()), baseline));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again.begin()->second.devices, std::vector<std::string>{"*"});
}

TEST(Baseline, EntriesThatMatchNothingAreReported) {
  const Baseline baseline = Reread(WriteBaseline(OneReport(RefusedSafeop())));
  const auto unmatched = [&baseline](const report::CaptureReport& capture) {
    const report::CaptureDigest digest = DigestOf(capture);
    return UnmatchedEntries(baseline, std::array{&digest});
  };
  EXPECT_TRUE(unmatched(RefusedSafeop()).empty());
  report::CaptureReport repaired = RefusedSafeop();
  repaired.result.findings.clear();
  ASSERT_EQ(unmatched(repaired).size(), 1U);
  EXPECT_EQ(unmatched(repaired)[0], "1 entry matches no finding: al-refused of slave 0");
  repaired.selection.to_frame = 3;
  EXPECT_TRUE(unmatched(repaired).empty()) << "the finding may lie outside";
  report::CaptureReport other = OnAnotherDevice();
  other.result.capture.file.path = "mill.pcapng";
  const std::vector<std::string> wrong_file{"all entries are for other devices or captures"};
  EXPECT_EQ(unmatched(other), wrong_file);
  other.selection.slaves = {"0"};
  EXPECT_EQ(unmatched(other), wrong_file) << "whichever part is shown";
  other.selection.slaves = {"1"};
  EXPECT_TRUE(unmatched(other).empty()) << "the device of slave 0 is not shown";
}

TEST(Baseline, AnUnreadCaptureDoesNotHideWhatOthersShow) {
  const Baseline baseline = Reread(WriteBaseline(OneReport(RefusedSafeop())));
  report::CaptureReport repaired = RefusedSafeop();
  repaired.result.findings.clear();
  report::CaptureDigest whole = DigestOf(repaired);
  report::CaptureDigest unread;
  unread.path = "mill.pcapng";
  unread.unreadable = "no such file";
  EXPECT_EQ(UnmatchedEntries(baseline, std::array<const report::CaptureDigest*, 2>{&whole, &unread}).size(), 1U);
  unread.path = "other/" + whole.path;
  EXPECT_TRUE(UnmatchedEntries(baseline, std::array<const report::CaptureDigest*, 2>{&whole, &unread}).empty())
      << "it may hold the finding";
}

TEST(Baseline, EntriesOfRulesThatDidNotRunStay) {
  const std::string written = WriteBaseline(OneReport(RefusedSafeop()));
  const Baseline known = Reread(written);
  report::CaptureReport later = RefusedSafeop();
  later.result.findings.clear();
  const auto unmatched = [&] {
    const report::CaptureDigest digest = DigestOf(later);
    return UnmatchedEntries(known, std::array{&digest}).size();
  };
  const auto rewritten = [&] { return Reread(WriteBaseline(OneReport(later), known)).size(); };
  EXPECT_EQ(unmatched(), 1U) << "it is repaired";
  EXPECT_EQ(rewritten(), 0U);
  later.rules = {{"al-refused", "warning"}};
  EXPECT_EQ(rewritten(), 0U);
  later.rules = {{"al-refused", "off"}};
  EXPECT_EQ(unmatched(), 0U);
  EXPECT_EQ(WriteBaseline(OneReport(later), known), written);
  EXPECT_EQ(WriteBaseline(DigestOf(OneReport(later)), known), written);
  // startup evaluates its own rules only.
  later.rules.clear();
  later.result.coverage = {{"startup-order", "Start-up", {{7, Coverage::kJudged, {}}}}};
  EXPECT_EQ(unmatched(), 0U);
  EXPECT_EQ(WriteBaseline(OneReport(later), known), written);
  later.result.coverage.push_back({"al-refused", "AL state machine", {{7, Coverage::kNotApplicable, {}}}});
  EXPECT_EQ(rewritten(), 0U);
}

TEST(Baseline, EntriesOfTheStartupStayWithoutAnExpectation) {
  const Baseline known = Reread(
      R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "startup-order", "slave": 0, "identity": ""}]})");
  report::CaptureReport later = RefusedSafeop();
  const auto rewritten = [&] {
    const Baseline all = Reread(WriteBaseline(OneReport(later), known));
    return std::count_if(all.begin(), all.end(), [](const auto& entry) { return entry.first.rule == "startup-order"; });
  };
  later.result.coverage = {
      {"startup-order", "Start-up", {{7, Coverage::kNotApplicable, NotApplicable::kNoExpectation}}}};
  EXPECT_EQ(rewritten(), 1);
  later.result.coverage[0].slaves[0] = {7, Coverage::kJudged, {}};
  EXPECT_EQ(rewritten(), 0) << "it is repaired";
}

TEST(Baseline, AnEntryThatNamesNoRuleIsReported) {
  const Baseline baseline = Reread(
      R"({"schema": "ecaudit.baseline/1", "findings": [{"rule": "al-refusd", "slave": 0, "identity": "refused"}]})");
  ASSERT_EQ(ExpiredEntries(baseline).size(), 1U);
  EXPECT_EQ(ExpiredEntries(baseline)[0], "'al-refusd' is no rule (did you mean 'al-refused'?)");
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
