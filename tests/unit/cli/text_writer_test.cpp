#include "cli/report/text_writer.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/report/layout.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::MakeFinding;
using test::MakeSlave;
using test::OneReport;
using test::RefusedSafeop;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string WrittenText(const CaptureReport& capture) {
  return WriteText(OneReport(capture), {});
}

std::vector<std::string> Lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Without the line breaks that the width made.
std::string Unwrapped(const std::string& text) {
  std::istringstream words(text);
  std::string out;
  for (std::string word; words >> word;) out += (out.empty() ? "" : " ") + word;
  return out;
}

std::size_t LineWith(const std::vector<std::string>& lines, const std::string& part) {
  const auto at = std::find_if(lines.begin(), lines.end(),
                               [&](const std::string& line) { return line.find(part) != std::string::npos; });
  return static_cast<std::size_t>(at - lines.begin());
}

TEST(TextWriter, FirstLineReportsWhatMattersMost) {
  EXPECT_EQ(Headline(RefusedSafeop()),
            "FAIL akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (frame 760)");
  EXPECT_THAT(WrittenText(RefusedSafeop()),
              StartsWith("FAIL akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (#760, "
                         "0.759 s)\n1 error, 0 warnings, 0 infos; 1 slave; 6.761 s from 2019-05-01 12:00:00 UTC\n"));
}

TEST(TextWriter, HeadlineNamesTheCauseOfTheWorstFinding) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings[0].caused_by = 1;
  capture.result.findings.push_back(MakeFinding("pdo-object-mapped-twice", Severity::kWarning, 7, 700));
  EXPECT_EQ(Headline(capture),
            "FAIL akd.pcapng: slave 0 (AKD, 0x1001): title of pdo-object-mapped-twice (frame 700); "
            "consequence: SAFEOP refused with AL status code 0x001d (frame 760)");
}

TEST(TextWriter, HeadlineNamesTheRootOfEqualFindings) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings[0].caused_by = 1;
  capture.result.findings.push_back(MakeFinding("sm-process-config", Severity::kError, 7, 700));
  EXPECT_EQ(Headline(capture), "FAIL akd.pcapng: slave 0 (AKD, 0x1001): title of sm-process-config (frame 700)");
}

TEST(TextWriter, CleanCapture) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings.clear();
  EXPECT_EQ(Headline(capture), "PASS akd.pcapng: no findings in 6,759 EtherCAT frames of 1 slave");
}

TEST(TextWriter, WarningsPassButAreNamed) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings[0].severity = Severity::kWarning;
  EXPECT_THAT(Headline(capture), StartsWith("PASS akd.pcapng: warning: slave 0 (AKD, 0x1001): SAFEOP refused"));
}

TEST(TextWriter, CaptureWithoutEtherCat) {
  CaptureReport capture;
  capture.result.capture.file.path = "http.pcap";
  capture.result.capture.packets = 120;
  const std::string text = WrittenText(capture);
  EXPECT_THAT(text, StartsWith("NOTHING-TO-CHECK http.pcap: no EtherCAT frame among 120 packets\n"));
  EXPECT_THAT(text, Not(HasSubstr("PASS")));
}

TEST(TextWriter, ConsequencesStandIndentedUnderTheirCause) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings.push_back(MakeFinding("al-timeout", Severity::kError, 7, 9000, 0));
  capture.result.findings.push_back(MakeFinding("emcy-received", Severity::kError, 7, 100));
  const std::vector<std::string> lines = Lines(WrittenText(capture));
  const std::size_t emergency = LineWith(lines, "f3 error emcy-received");
  const std::size_t cause = LineWith(lines, "f1 error al-refused");
  const std::size_t consequence = LineWith(lines, "f2 consequence: error al-timeout");
  EXPECT_LT(emergency, cause) << "equal severity: by frame";
  ASSERT_LT(cause, consequence);
  ASSERT_LT(consequence, lines.size());
  EXPECT_GT(lines[consequence].find_first_not_of(' '), lines[cause].find_first_not_of(' '));
}

TEST(TextWriter, FindingShowsEvidenceFilterAndSource) {
  const std::string text = WrittenText(RefusedSafeop());
  EXPECT_THAT(text, HasSubstr("frame 760 at 0.759000 s, seen 5,999 times, last in frame 6762"));
  EXPECT_THAT(text, HasSubstr("al_status_code = 0x001d, polls = 5999, mean_ms = 1.500 ms,\n"
                              "                 requested = SAFEOP"));
  EXPECT_THAT(text, HasSubstr("frame.number==760 || frame.number==6762 || frame.number==743"));
  EXPECT_THAT(text, HasSubstr("AKD EtherCAT Communication, 4.3"));
  EXPECT_THAT(text, HasSubstr("ecaudit explain al-refused"));
  EXPECT_THAT(text, HasSubstr("Check the output sync manager"));
}

TEST(TextWriter, FindingsStandBeforeSlavesAndTheCaptureLast) {
  const std::vector<std::string> lines = Lines(WrittenText(RefusedSafeop()));
  const std::vector<std::string> order{"Findings", "Slaves", "Not evaluated", "Capture"};
  for (std::size_t i = 1; i < order.size(); ++i) {
    EXPECT_LT(LineWith(lines, order[i - 1]), LineWith(lines, order[i])) << order[i];
  }
  EXPECT_EQ(lines[2], "");
  EXPECT_EQ(lines[3], "Findings");
}

TEST(TextWriter, QuietIsTheVerdict) {
  Report report = OneReport(RefusedSafeop());
  TextStyle style;
  style.quiet = true;
  EXPECT_EQ(Lines(WriteText(report, style)).size(), 1U);
  report.captures.push_back(RefusedSafeop());
  const std::vector<std::string> lines = Lines(WriteText(report, style));
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_THAT(lines[2], StartsWith("FAIL 2 captures, 2 failed"));
}

TEST(TextWriter, ClockTimes) {
  TextStyle style;
  style.time = TimeMode::kUtc;
  const std::string text = WriteText(OneReport(RefusedSafeop()), style);
  EXPECT_THAT(text, HasSubstr("frame 760 at 12:00:00.759000, seen 5,999 times, last in frame 6762"));
  EXPECT_THAT(text, HasSubstr("PREOP #400 at 12:00:00.399 ->"));
}

TEST(TextWriter, SlaveStory) {
  const std::string text = Unwrapped(WrittenText(RefusedSafeop()));
  EXPECT_THAT(text, HasSubstr("vendor 0x0000006a, product 0x00414b44, revision 0x00000002"));
  EXPECT_THAT(text, HasSubstr("kollmorgen-akd-2011 (EEPROM identity)"));
  EXPECT_THAT(text, HasSubstr("PREOP #400 at 0.399 s -> SAFEOP requested #743 at 0.742 s ->"));
  EXPECT_THAT(text, HasSubstr(" PREOP+ERR code 0x001d #760 at 0.759 s"));
}

TEST(TextWriter, MailboxTrafficInOneLine) {
  CaptureReport capture = RefusedSafeop();
  EXPECT_THAT(Unwrapped(WrittenText(capture)), Not(HasSubstr(" mailbox ")))
      << "no line where the mailboxes were not used";
  MailboxSummary& mailbox = capture.result.slaves[0].mailbox;
  mailbox.requests = 1;
  mailbox.by_protocol = {{"CoE", 1, 0}};
  EXPECT_THAT(Unwrapped(WrittenText(capture)), HasSubstr("mailbox 1 request, 0 responses (CoE)"));
  mailbox = {52, 53, 40, 11, 2, 1, 3, 4, {{"error", 0, 3}, {"CoE", 50, 50}, {"FoE", 2, 0}}};
  EXPECT_THAT(Unwrapped(WrittenText(capture)),
              HasSubstr("52 requests, 53 responses (CoE, FoE); 40 uploads, 11 downloads, 2 aborted, 1 emergency, "
                        "3"));
  EXPECT_THAT(Unwrapped(WrittenText(capture)), HasSubstr("4 unanswered"));
}

TEST(TextWriter, RequestsThatAreFollowedGoWithoutSaying) {
  CaptureReport capture = RefusedSafeop();
  capture.result.slaves[0].al_history = {
      test::MakeStep(AlStep::Kind::kState, 10, 0, 1), test::MakeStep(AlStep::Kind::kRequest, 20, 1, 2),
      test::MakeStep(AlStep::Kind::kState, 30, 1, 2), test::MakeStep(AlStep::Kind::kRequest, 40, 2, 4)};
  EXPECT_THAT(Unwrapped(WrittenText(capture)),
              HasSubstr("AL states INIT #10 at 0.009 s -> PREOP #30 at 0.029 s -> SAFEOP requested #40 at 0.039 s"));
}

TEST(TextWriter, TheSameRequestAgainAndAgainIsOneStep) {
  CaptureReport capture = RefusedSafeop();
  std::vector<AlStep>& history = capture.result.slaves[0].al_history;
  history.clear();
  for (FrameNo frame = 1; frame <= 70; ++frame) history.push_back(test::MakeStep(AlStep::Kind::kRequest, frame, 1, 2));
  history.push_back(test::MakeStep(AlStep::Kind::kState, 80, 1, 2));
  EXPECT_THAT(Unwrapped(WrittenText(capture)),
              HasSubstr("AL states PREOP requested 70 times #1 at 0.000 s to #70 at 0.069 s -> PREOP #80 at 0.079 s"));
  // Another state between them, or another answer, is a step of its own.
  history = {test::MakeStep(AlStep::Kind::kRequest, 1, 1, 2), test::MakeStep(AlStep::Kind::kRequest, 2, 1, 4),
             test::MakeStep(AlStep::Kind::kRequest, 3, 1, 2)};
  EXPECT_THAT(Unwrapped(WrittenText(capture)), HasSubstr("PREOP requested #1 at 0.000 s -> SAFEOP requested #2"));
}

TEST(TextWriter, LongStoriesAreShortened) {
  CaptureReport capture = RefusedSafeop();
  std::vector<AlStep>& history = capture.result.slaves[0].al_history;
  history.clear();
  for (FrameNo frame = 1; frame <= 1000; ++frame)
    history.push_back(test::MakeStep(AlStep::Kind::kState, frame, 0, 0x02));
  const std::string text = Unwrapped(WrittenText(capture));
  EXPECT_THAT(text, HasSubstr("PREOP #1 "));
  EXPECT_THAT(text, HasSubstr("[984 more steps]"));
  EXPECT_THAT(text, HasSubstr("PREOP #1000 "));
  EXPECT_THAT(text, Not(HasSubstr("PREOP #500 ")));
}

TEST(TextWriter, AlikeQuietSlavesAreReportedOnce) {
  CaptureReport capture = RefusedSafeop();
  for (SlaveId id = 100; id < 139; ++id) {
    capture.result.slaves.push_back(
        MakeSlave(id, static_cast<SlavePos>(id - 99), static_cast<StationAddress>(0x1002 + id - 100), "IO"));
  }
  const std::string text = WrittenText(capture);
  EXPECT_THAT(text, HasSubstr("slave 1 (IO, 0x1002)"));
  EXPECT_THAT(text, HasSubstr("slaves 2-39: the same device"));
  EXPECT_THAT(text, Not(HasSubstr("slave 17")));
}

TEST(TextWriter, KnownFindingsAreShownApart) {
  CaptureReport capture = RefusedSafeop();
  capture.known = {true};
  const std::string text = WrittenText(capture);
  EXPECT_THAT(text, StartsWith("PASS akd.pcapng: no new findings"));
  EXPECT_THAT(text, HasSubstr("Known from the baseline"));
  EXPECT_THAT(text, HasSubstr("error al-refused, slave 0 (AKD, 0x1001)"));
}

TEST(TextWriter, UntrustedTextNeverReachesTheTerminal) {
  CaptureReport capture = RefusedSafeop();
  AnalysisResult& r = capture.result;
  const std::string evil = "\x1b]0;owned\x07\xff\r\n";
  r.capture.file.path = evil;
  r.slaves[0].name = evil;
  r.slaves[0].profile_source = evil;
  test::SetTexts(r.findings[0], evil, evil);
  r.findings[0].Set("from_the_capture", arg::Text(evil));
  r.findings[0].reference = {evil, evil};
  r.not_evaluable[0].reason = test::Because(evil);
  r.capture.file.damage = capture::Damage{evil, 0, 0};
  for (const char c : WrittenText(capture)) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
}

TextStyle Colored() {
  TextStyle style;
  style.color = true;
  return style;
}

TEST(TextWriter, ColourOnlyWhenAsked) {
  EXPECT_THAT(WrittenText(RefusedSafeop()), Not(HasSubstr("\x1b")));
  EXPECT_THAT(WriteText(OneReport(RefusedSafeop()), Colored()), StartsWith("\x1b[1;31mFAIL\x1b[0m akd.pcapng"));
}

TEST(TextWriter, ReasonsAreGrouped) {
  CaptureReport capture = RefusedSafeop();
  capture.result.not_evaluable.push_back({"sync-rate-deviation", 7, test::Because("DC"), 0, 1});
  EXPECT_THAT(WrittenText(capture), HasSubstr("  DC is not in the capture: sync-lost, sync-rate-deviation\n"));
}

TEST(TextWriter, LinesFitAndLoseNoWord) {
  CaptureReport capture = RefusedSafeop();
  std::string message;
  for (int i = 0; i < 100; ++i) message += "word" + std::to_string(i) + " ";
  test::SetTexts(capture.result.findings[0], "SAFEOP refused with AL status code 0x001d", message);
  const std::string text = WrittenText(capture);
  for (const std::string& line : Lines(text)) {
    if (line.find("word") != std::string::npos) {
      EXPECT_LE(Columns(line), kLineWidth) << line;
    }
  }
  for (int i = 0; i < 100; ++i) EXPECT_THAT(text, HasSubstr("word" + std::to_string(i)));
}

TEST(TextWriter, SeveralCapturesEndWithASum) {
  Report report = OneReport(RefusedSafeop());
  report.captures.push_back(RefusedSafeop());
  report.captures[1].result.findings.clear();
  EXPECT_THAT(WriteText(report, {}), HasSubstr("\nFAIL 2 captures, 1 failed: 1 error, 0 warnings, 0 infos\n"));
}

TEST(TextWriter, DamageIsReported) {
  CaptureReport capture = RefusedSafeop();
  capture.result.capture.complete = false;
  capture.result.capture.file.damage = capture::Damage{"file ends inside packet 812", 4711, 811};
  EXPECT_THAT(WrittenText(capture), HasSubstr("damaged: file ends inside packet 812"));
}

}  // namespace
}  // namespace ecaudit::report
