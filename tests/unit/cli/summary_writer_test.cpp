#include "cli/report/summary_writer.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/report/summary_tally.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::MakeFinding;
using test::RefusedSafeop;

CaptureDigest Named(CaptureReport capture, std::string path) {
  capture.result.capture.file.path = std::move(path);
  return DigestOf(capture);
}

/// One that fails twice, one with a warning, a clean one, one without EtherCAT, one that cannot be read.
Digest Fleet() {
  CaptureReport failed = RefusedSafeop();
  failed.result.findings.push_back(MakeFinding("al-refused", Severity::kError, 7, 900));
  CaptureReport warned = RefusedSafeop();
  warned.result.findings = {MakeFinding("frame-lost", Severity::kWarning, kNoSlave, 5)};
  CaptureReport clean = RefusedSafeop();
  clean.result.findings.clear();
  Digest digest;
  digest.version = "1.2.3";
  digest.captures = {Named(failed, "a.pcap"), Named(warned, "b.pcap"), Named(clean, "c.pcap"),
                     Named(CaptureReport{}, "d.pcap"), CaptureDigest{}};
  digest.captures.back().path = "e.pcap";
  digest.captures.back().unreadable = "e.pcap is empty";
  return digest;
}

TEST(SummaryWriter, Text) {
  EXPECT_EQ(WriteSummaryText(Fleet(), {}),
            "FAIL 5 captures, 1 failed: 2 errors, 1 warning, 0 infos; 1 could not be read; 1 without EtherCAT\n"
            "\n"
            "Findings by rule\n"
            "  error    al-refused  1 capture, 2 findings\n"
            "           e.g. a.pcap frame 760: slave 0 (AKD, 0x1001): SAFEOP refused with AL\n             status code "
            "0x001d\n"
            "  warning  frame-lost  1 capture\n"
            "           e.g. b.pcap frame 5: bus: title of frame-lost\n"
            "\n"
            "Captures\n"
            "  FAIL a.pcap: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (frame 760 at 0.759 s)\n"
            "  ERROR e.pcap is empty\n"
            "  PASS b.pcap: warning: bus: title of frame-lost (frame 5 at 0.004 s)\n"
            "  NOTHING-TO-CHECK d.pcap: the capture holds no packet\n"
            "  PASS c.pcap: no findings in 6,759 EtherCAT frames of 1 slave\n");
}

TEST(SummaryWriter, Json) {
  const auto json = nlohmann::json::parse(WriteSummaryJson(Fleet()));
  EXPECT_EQ(json["summary"], nlohmann::json::parse(
                                 R"({"captures": 5, "passed": 2, "failed": 1, "unmet": 0, "limited": 0, "unreadable": 1,
    "nothing_to_check": 1, "not_reached": 0, "errors": 2, "warnings": 1, "infos": 0, "known": 0, "verdict": "fail"})"));
  EXPECT_EQ(json["rules"], nlohmann::json::parse(R"([
    {"rule": "al-refused", "severity": "error", "captures": 1, "findings": 2},
    {"rule": "frame-lost", "severity": "warning", "captures": 1, "findings": 1}])"));
  EXPECT_EQ(json["captures"][0]["findings"][0], nlohmann::json::parse(R"({"rule": "al-refused", "severity": "error",
    "title": "SAFEOP refused with AL status code 0x001d", "slave": 0, "station_address": 4097, "frame": 760,
    "count": 5999, "known": false, "fails": true})"));
  EXPECT_EQ(json["captures"][4]["error"], "e.pcap is empty");
  EXPECT_EQ(json["captures"][4]["packets"], nullptr);
}

TEST(SummaryWriter, Verdicts) {
  Digest digest = Fleet();
  EXPECT_EQ(TallyOf(digest).Verdict(digest), "fail");
  digest.captures.erase(digest.captures.begin());
  EXPECT_EQ(TallyOf(digest).Verdict(digest), "incomplete");
  digest.captures.pop_back();
  EXPECT_EQ(TallyOf(digest).Verdict(digest), "pass");
  digest.not_reached = 3;
  EXPECT_EQ(TallyOf(digest).Verdict(digest), "incomplete");
  EXPECT_EQ(WriteSummaryText(digest, {}).substr(0, 10), "INCOMPLETE");
}

TEST(SummaryWriter, KnownFindingsAreNotTallied) {
  Digest digest = Fleet();
  for (FindingDigest& f : digest.captures[0].findings) f.known = true;
  const Tally tally = TallyOf(digest);
  EXPECT_EQ(tally.failed, 0U);
  EXPECT_EQ(tally.findings.known, 2U);
  ASSERT_EQ(tally.rules.size(), 1U);
  EXPECT_EQ(tally.rules[0].rule, "frame-lost");
}

TEST(SummaryWriter, NoEscapeSequencesWithoutColor) {
  EXPECT_EQ(WriteSummaryText(Fleet(), {}).find('\x1b'), std::string::npos);
  TextStyle colored;
  colored.color = true;
  EXPECT_NE(WriteSummaryText(Fleet(), colored).find("\x1b[1;31mFAIL"), std::string::npos);
}

}  // namespace
}  // namespace ecaudit::report
