#include "cli/report/digest.h"

#include <gtest/gtest.h>

#include "analyzers/result/every_slave.h"
#include "cli/report/digest_json.h"
#include "cli/report/json_writer.h"
#include "cli/report/sentences.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::Frame;
using test::MakeFinding;
using test::OneReport;
using test::RefusedSafeop;

Result<ReportDigest> ReadBack(const Report& report) {
  return ReadReportDigest(ReadJson(WriteJson(report)).document->root());
}

/// A result whose texts and numbers are as awkward as they get.
CaptureReport Awkward() {
  CaptureReport capture = RefusedSafeop();
  AnalysisResult& r = capture.result;
  r.capture.file.path = "dir/\x1b\xff name.pcap";
  r.slaves[0].name = "a\tb\nc";
  test::SetTexts(r.findings[0], "title\twith \xC3\xBC", "line 1\nline 2\x01", "awkward");
  r.findings.push_back(MakeFinding("frame-lost", Severity::kWarning, kNoSlave, 1, 0));
  r.findings.push_back(MakeFinding("sdo-abort", Severity::kInfo, 7, 0));
  r.findings[2].first = {};
  r.findings[2].last = {};
  r.findings[2].confidence = Confidence::kInferred;
  test::SetTexts(r.findings[2], report::TitleOf(r.findings[2]));
  r.capture.complete = false;
  capture.known = {false, true, false};
  capture.fail_on = FailOn::kWarning;
  capture.baseline = "known.json";
  capture.judged = false;
  capture.selection = {0.0001, 1e6, 7, std::nullopt, {"0", "0x1001"}, {1}, "--isolate", {1, 2, 3}};
  r.not_evaluable.push_back({"al-timeout", kEverySlave, test::Because("no times"), 0, 1});
  capture.rules = {{"al-refused", "warning"}, {"sdo-abort", "off"}};
  capture.required = "slaves=2";
  capture.unmet = {"slaves=2: the capture\nshows 1 slave"};
  r.coverage = {{"al-refused", "AL state machine", {{7, Coverage::kPartly, {}}}},
                {"sdo-abort", "Mailbox and CoE", {{7, Coverage::kNotApplicable, NotApplicable::kSwitchedOff}}}};
  return capture;
}

TEST(Digest, ReportsReadBackGiveTheSame) {
  CaptureReport empty;
  empty.result.capture.file.path = "empty.pcap";
  for (const CaptureReport& capture : {RefusedSafeop(), Awkward(), empty}) {
    const auto digest = ReadBack(OneReport(capture));
    ASSERT_TRUE(digest) << digest.error().message;
    ASSERT_EQ(digest->captures.size(), 1U);
    EXPECT_EQ(digest->captures[0], DigestOf(capture)) << capture.result.capture.file.path;
    EXPECT_EQ(digest->version, "1.2.3");
    EXPECT_EQ(digest->origin, Origin{});
  }
}

TEST(Digest, ReportsWhatWasLookedAtAndWhatWasNotEvaluated) {
  CaptureReport capture = Awkward();
  EXPECT_EQ(Text(capture.selection), "--slave 0 --slave 0x1001 --interface 1 --from 0.0001 --from #7 --to 1000000");
  EXPECT_EQ(HeadlinePartsOf(DigestOf(capture)).verdict, "NOT-JUDGED");
  EXPECT_EQ(PlaceOf(DigestOf(capture).not_judged.back(), {}), "all slaves");
  capture.selection = {};
  EXPECT_EQ(Text(capture.selection), "");
  capture.judged = true;
  capture.selection.to_frame = 100;
  const std::string sentence = HeadlinePartsOf(DigestOf(capture)).sentence;
  EXPECT_TRUE(sentence.ends_with(" (limited by --to #100)")) << sentence;
  capture.selection.outside = {1, 0, 2};
  EXPECT_EQ(LimitsText(capture.selection), "--to #100; outside it: 1 error, 2 infos");
  capture.selection.outside = {};
  capture.selection.isolated_by = "--isolate";
  EXPECT_EQ(LimitsText(capture.selection), "--to #100; packets outside it were not evaluated (--isolate)");
  capture.selection = {};
  capture.selection.from_s = 0.025383970999999894;
  EXPECT_EQ(Text(capture.selection), "--from 0.025383971");
}

TEST(Digest, FindingsNameTheLastSlaveAtTheirPosition) {
  CaptureReport capture = RefusedSafeop();
  capture.result.slaves.push_back(capture.result.slaves[0]);
  capture.result.slaves[1].id = 99;
  capture.result.slaves[1].name = std::string(5000, 'n');
  capture.result.slaves[1].identity.product_code = 0x1234;
  const auto digest = ReadBack(OneReport(capture));
  ASSERT_TRUE(digest) << digest.error().message;
  const FindingDigest& finding = digest->captures[0].findings[0];
  EXPECT_TRUE(finding.product.ends_with("0x00001234")) << finding.product;
  EXPECT_LT(finding.place.size(), 1100U) << "each finding repeats it";
}

TEST(Digest, CapturesAreOrderedByAllThatIsReportedOfThem) {
  const CaptureDigest one = DigestOf(RefusedSafeop());
  CaptureDigest other = one;
  other.report = "elsewhere.json";
  const CaptureContent& content = one;
  EXPECT_FALSE(content < other || other < content);
  other.findings[0].related_frames.push_back(1);
  EXPECT_NE(content < other, static_cast<const CaptureContent&>(other) < content);
  other = one;
  other.duration_s = 77;
  EXPECT_NE(content < other, static_cast<const CaptureContent&>(other) < content);
}

TEST(Digest, UnreadableCapturesAndOriginAreReadBack) {
  Report report = OneReport(RefusedSafeop());
  report.unreadable = {{"b.pcap", "b.pcap is empty"}};
  report.origin = {"0123456789abcdef", 42, "2019-05-01T12:00:00.000000000Z"};
  const auto digest = ReadBack(report);
  ASSERT_TRUE(digest) << digest.error().message;
  EXPECT_EQ(digest->captures, DigestOf(report).captures);
  EXPECT_EQ(digest->captures[1].unreadable, "b.pcap is empty");
  EXPECT_EQ(digest->origin, report.origin);
}

TEST(Digest, OtherDocumentsAreRefused) {
  for (const char* text : {"null", "[]", "{}", R"({"schema": 1})", R"({"schema": "ecaudit.report/2"})",
                           R"({"schema": "ecaudit.report/1"})"}) {
    EXPECT_FALSE(ReadReportDigest(ReadJson(text).document->root())) << text;
  }
}

TEST(Digest, Headlines) {
  CaptureDigest capture = DigestOf(RefusedSafeop());
  EXPECT_EQ(Headline(capture),
            "FAIL akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (frame 760)");
  capture.fail_on = FailOn::kNever;
  EXPECT_EQ(Headline(capture),
            "PASS akd.pcapng: error: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (frame 760)");
  capture.findings.clear();
  EXPECT_EQ(Headline(capture), "PASS akd.pcapng: no findings in 6,759 EtherCAT frames of 1 slave");
  capture.slaves_there = 7;
  EXPECT_EQ(Headline(capture),
            "PASS akd.pcapng: no findings in 6,759 EtherCAT frames of 7 slaves, 6 of them known by broadcasts only");
  capture.slaves_there = 0;
  capture.not_judged.push_back({"frame-lost", {}, "the capture misses packets", false, "misses-packets"});
  EXPECT_EQ(Headline(capture),
            "PASS akd.pcapng: no findings in 6,759 EtherCAT frames of 1 slave, but the capture misses packets");
  capture.not_judged.clear();
  capture.limited = "slave 0: neither its AL state nor its process data are known";
  EXPECT_EQ(
      Headline(capture),
      "LIMITED akd.pcapng: no findings in 6,759 EtherCAT frames of 1 slave; not evaluated: slave 0: neither its AL "
      "state nor its process data are known");
  capture.limited.clear();
  capture.unmet = {"slaves=2: the capture shows 1 slave", "judged: no"};
  EXPECT_EQ(Headline(capture),
            "UNMET akd.pcapng: no findings in 6,759 EtherCAT frames of 1 slave; required and missing: slaves=2: the "
            "capture shows 1 slave; judged: no");
  CaptureDigest unreadable;
  unreadable.path = "x.pcap";
  unreadable.unreadable = "x.pcap is empty";
  EXPECT_EQ(Headline(unreadable), "ERROR x.pcap is empty");
}

}  // namespace
}  // namespace ecaudit::report
