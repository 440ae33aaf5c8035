#include "cli/report/verdict_line.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "tests/support/folders.h"
#include "tests/support/trace_builder.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::MakeFinding;
using test::RefusedSafeop;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string Line(const CaptureReport& capture, const TextStyle& style = {}, bool whole_path = false) {
  const VerdictLine line = VerdictLineOf(DigestOf(capture), style, whole_path);
  return line.word + line.rest;
}

TEST(VerdictLine, WhatWhereAndWhen) {
  EXPECT_EQ(Line(RefusedSafeop()),
            "FAIL akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (#760, 0.759 s)");
}

TEST(VerdictLine, CauseStandsBeforeMissedPackets) {
  std::ifstream file(std::filesystem::path(test::SourceDir()) / "tests/reports/bus/icube84-no-start-bit.trace");
  std::stringstream text;
  text << file.rdbuf();
  text << "@slaves 1\n+10ms BRD 0x0130 08 00 @out-only times=12\n+10ms BRD 0x0130 08 00 @returned-only times=12\n";
  const auto trace = test::Trace::Parse(text.str());
  ASSERT_TRUE(trace) << trace.error().message;
  CaptureReport capture;
  capture.result = Analyse(*trace->Source(), {});
  const std::string line = Line(capture);
  EXPECT_THAT(line, HasSubstr("slave 0: Bit 4 of the control word"));
  EXPECT_THAT(line, HasSubstr("but the capture misses packets"));
}

TEST(VerdictLine, ClockTime) {
  TextStyle style;
  style.time = TimeMode::kUtc;
  EXPECT_THAT(Line(RefusedSafeop(), style), EndsWith("760 at 12:00:00.759)"));
}

TEST(VerdictLine, NeverLongerThanItMayBe) {
  CaptureReport capture = RefusedSafeop();
  const std::string wide = "\xE8\xBB\xB8";  // two columns
  for (const std::string& path :
       {std::string("a.pcapng"), std::string(40, 'd') + "/" + std::string(20, 'n') + ".pcapng",
        std::string(200, 'n') + ".pcapng", "x/" + wide + wide + wide + ".pcapng"}) {
    for (const std::string& name : {std::string("AKD"), std::string(70, 'N'), wide + " " + wide}) {
      for (const std::string& title :
           {std::string("short"), "a long story " + std::string(20, 'w') + " of " + std::string(90, 'x') + wide}) {
        capture.result.capture.file.path = path;
        capture.result.slaves[0].name = name;
        test::SetTexts(capture.result.findings[0], title);
        const std::string line = Line(capture);
        EXPECT_LE(Columns(line), kVerdictColumns) << line;
        EXPECT_THAT(line, StartsWith("FAIL "));
        EXPECT_THAT(line, HasSubstr("slave 0"));
        EXPECT_THAT(line, testing::ContainsRegex("760(( at|,) 0.759 s)?\\)$"));
      }
    }
  }
}

TEST(VerdictLine, WhatStandsInBracketsIsExplanation) {
  CaptureReport capture = RefusedSafeop();
  capture.result.capture.file.path = "soem-sdinfo-akd.pcapng";
  test::SetTexts(capture.result.findings[0],
                 "SAFEOP refused in PREOP with AL status code 0x001d (invalid output configuration)");
  EXPECT_EQ(Line(capture),
            "FAIL slave 0: SAFEOP refused in PREOP with AL status code 0x001d (invalid output configuration)");
  test::SetTexts(capture.result.findings[0],
                 "SAFEOP refused in PREOP with AL status code 0x001d (invalid output configuration of the slave)");
  EXPECT_EQ(Line(capture), "FAIL slave 0: SAFEOP refused in PREOP with AL status code 0x001d (#760)");
}

TEST(VerdictLine, FolderGoesFirst) {
  CaptureReport capture = RefusedSafeop();
  capture.result.capture.file.path = "captures/2026/march/line4/akd.pcapng";
  EXPECT_THAT(Line(capture), StartsWith("FAIL akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused"));
  EXPECT_THAT(Line(capture, {}, true),
              StartsWith("FAIL captures/2026/march/line4/akd.pcapng: slave 0: SAFEOP refused"));
}

TEST(VerdictLine, KeepsTheWholeCause) {
  CaptureReport capture = RefusedSafeop();
  const std::string title = "OP refused in SAFEOP with AL status code 0x001b (sync manager watchdog)";
  test::SetTexts(capture.result.findings[0], title);
  for (const std::string& path : {std::string("a.pcapng"), "captures/" + std::string(80, 'n') + ".pcapng"}) {
    capture.result.capture.file.path = path;
    EXPECT_THAT(Line(capture), HasSubstr("slave 0: " + title + " (#760"));
    EXPECT_THAT(Line(capture, {}, true), HasSubstr("slave 0: " + title + " (#760"));
  }
  EXPECT_EQ(Line(capture), "FAIL slave 0: " + title + " (#760)");
}

TEST(VerdictLine, WhatHoldsLeadsAmongItsEquals) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings = {MakeFinding("capture-x", Severity::kWarning, 7, 5),
                             MakeFinding("drive-x", Severity::kWarning, 7, 6)};
  EXPECT_THAT(Line(capture), HasSubstr("title of capture-x"));
  EXPECT_THAT(Line(capture), StartsWith("PASS "));
  capture.result.findings[1].holds = "enabled";
  EXPECT_THAT(Line(capture), HasSubstr("title of drive-x"));
  EXPECT_THAT(Line(capture), StartsWith("FAIL ")) << "an axis that is not enabled is not PASS";
  capture.fail_on = FailOn::kNever;
  EXPECT_THAT(Line(capture), StartsWith("PASS "));
  capture.fail_on = FailOn::kError;
  capture.known = {false, true};
  EXPECT_THAT(Line(capture), StartsWith("PASS "));
}

/// One frame of thousands was lost, and nothing followed from it.
TEST(VerdictLine, AnErrorAsideLeadsBeforeWhatHoldsNothing) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings = {MakeFinding("frame-x", Severity::kError, 7, 5),
                             MakeFinding("drive-x", Severity::kWarning, 7, 6)};
  capture.result.findings[0].aside = true;
  EXPECT_THAT(Line(capture), HasSubstr("title of frame-x"));
  capture.result.findings[1].holds = "enabled";
  EXPECT_THAT(Line(capture), HasSubstr("title of drive-x"));
  EXPECT_THAT(Line(capture), StartsWith("FAIL "));
  capture.result.findings[0].aside = false;
  EXPECT_THAT(Line(capture), HasSubstr("title of frame-x"));
  capture.result.findings[0].aside = true;
  capture.result.findings[1] = MakeFinding("drive-x", Severity::kError, 7, 6);
  EXPECT_THAT(Line(capture), HasSubstr("title of drive-x"));
}

TEST(VerdictLine, TheRootCauseLeads) {
  CaptureReport capture = RefusedSafeop();
  test::SetTexts(capture.result.findings[0], "SAFEOP refused");
  capture.result.findings[0].caused_by = 1;
  capture.result.findings.push_back(MakeFinding("pdo-x", Severity::kWarning, 7, 700));
  capture.result.slaves[0].name.clear();
  capture.result.capture.file.path = "a.pcapng";
  EXPECT_EQ(Line(capture),
            "FAIL a.pcapng: slave 0 (0x1001): title of pdo-x; consequence: SAFEOP refused (frame 700 at 0.699 s)");
  test::SetTexts(capture.result.findings[1], std::string(60, 'x'));
  EXPECT_THAT(Line(capture), Not(HasSubstr("consequence")));
  EXPECT_THAT(Line(capture), HasSubstr(std::string(60, 'x')));
  EXPECT_LE(Columns(Line(capture)), kVerdictColumns);
}

TEST(VerdictLine, AReservationIsNeverCut) {
  CaptureReport capture = RefusedSafeop();
  const Finding warning = MakeFinding("any", Severity::kWarning, 7, 760);
  capture.result.capture.file.path = std::string(80, 'n') + ".pcapng";
  capture.result.not_evaluable.push_back({"r", kNoSlave, Reason::Of(ReasonCode::kMissesPackets), 0, 1});
  for (const std::vector<Finding>& findings : {std::vector<Finding>{}, {warning}}) {
    capture.result.findings = findings;
    EXPECT_THAT(Line(capture), StartsWith("PASS "));
    EXPECT_THAT(Line(capture), EndsWith(", but the capture misses packets"));
    EXPECT_LE(Columns(Line(capture)), kVerdictColumns);
  }
  capture.result.coverage = {{"a", "c", {{7, Coverage::kNotJudged, {}}}}};
  EXPECT_THAT(Line(capture), EndsWith(", but the capture misses packets and more"));
  capture.result.not_evaluable.clear();
  EXPECT_THAT(Line(capture), EndsWith(", but only 0 of 1 evaluated"));
  // It is about a pass: an error is no less true.
  capture.result.findings[0].severity = Severity::kError;
  EXPECT_THAT(Line(capture), Not(HasSubstr("but only")));
}

TEST(VerdictLine, WhatLiesOutsideAWindowIsNeverCut) {
  CaptureReport capture = RefusedSafeop();
  const Finding warning = MakeFinding("any", Severity::kWarning, 7, 760);
  capture.selection.from_frame = 250;
  capture.selection.to_frame = 260;
  capture.selection.outside = {1, 0, 0};
  capture.result.findings.clear();
  capture.result.capture.file.path = "akd.pcapng";
  EXPECT_EQ(Line(capture),
            "PASS akd.pcapng: no findings in the range (outside it: 1 error) (limited by --from #250 "
            "--to #260)");
  for (const std::vector<Finding>& findings : {std::vector<Finding>{}, {warning}}) {
    capture.result.findings = findings;
    const std::string outside = findings.empty() ? " (outside it: 1 error)" : " (outside the range: 1 error)";
    capture.result.not_evaluable.clear();
    for (const std::size_t length : {std::size_t{10}, std::size_t{80}}) {
      capture.result.capture.file.path = std::string(length, 'n') + ".pcapng";
      EXPECT_THAT(Line(capture), HasSubstr(outside));
      EXPECT_LE(Columns(Line(capture)), kVerdictColumns);
    }
    capture.result.not_evaluable.push_back({"r", kNoSlave, Reason::Of(ReasonCode::kMissesPackets), 0, 1});
    EXPECT_THAT(Line(capture), HasSubstr(outside + ", but the capture misses packets"));
    EXPECT_LE(Columns(Line(capture)), kVerdictColumns);
    EXPECT_THAT(VerdictNotes(DigestOf(capture)),
                testing::Contains("limited by --from #250 --to #260; outside it: 1 error"));
  }
  // Packets outside were not evaluated: nothing is known of them.
  capture.result.findings.clear();
  capture.result.not_evaluable.clear();
  capture.selection.outside = {};
  capture.selection.isolated_by = "--isolate";
  capture.result.capture.file.path = "akd.pcapng";
  EXPECT_THAT(Line(capture), HasSubstr("EtherCAT frame"));
}

TEST(VerdictLine, ANarrowTerminalHasAShorterLine) {
  TextStyle style;
  style.verdict_width = 60;
  EXPECT_EQ(Line(RefusedSafeop(), style), "FAIL slave 0: SAFEOP refused with AL status code 0x001d");
  style.verdict_width = 50;
  EXPECT_LE(Columns(Line(RefusedSafeop(), style)), 50U);
  EXPECT_THAT(Line(RefusedSafeop(), style), EndsWith(" (#760)"));
}

TEST(VerdictLine, NotesSayWhatTheLineHasNoRoomFor) {
  CaptureReport capture = RefusedSafeop();
  capture.unmet = {"slaves=2: the capture shows 1 slave", "state=OP: slave 0 is in PREOP at the end"};
  capture.result.slaves[0].not_evaluated = test::Because("its AL state");
  capture.selection.to_frame = 100;
  EXPECT_THAT(VerdictNotes(DigestOf(capture)),
              ElementsAre("required and missing: slaves=2: the capture shows 1 slave; state=OP: slave 0 is in PREOP at "
                          "the end",
                          "not evaluated: slave 0: its AL state is not in the capture", "limited by --to #100"));
  capture.result.findings.clear();
  EXPECT_THAT(Line(capture), StartsWith("UNMET akd: required and missing: slaves=2: the capture shows 1 slave"));
}

}  // namespace
}  // namespace ecaudit::report
