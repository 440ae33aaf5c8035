#include "cli/report/sarif_writer.h"

#include <array>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using nlohmann::json;
using test::MakeFinding;
using test::OneReport;
using test::RefusedSafeop;

constexpr RuleInfo kRefused{.id = "al-refused",
                            .group = "AL state machine",
                            .severity = Severity::kError,
                            .title = "A state request was refused",
                            .needs = "AL status",
                            .source = "AKD-2011, 4.3",
                            .doc = "\n## What it checks\n\nRefusals.\n"};
const std::array<const RuleInfo*, 1> kRules{&kRefused};

TEST(SarifWriter, LinksToThePagesOfRulesWhereTheProjectHasAPlace) {
  Report report = OneReport(RefusedSafeop());
  report.rules = kRules;
  const json with = json::parse(WriteSarif(DigestOf(report), {}, "https://example.org/ecaudit"))["runs"][0];
  EXPECT_EQ(with["tool"]["driver"]["informationUri"], "https://example.org/ecaudit");
  EXPECT_EQ(with["tool"]["driver"]["rules"][0]["helpUri"], "https://example.org/ecaudit/docs/rules.md#al-refused");
  const json without = json::parse(WriteSarif(DigestOf(report), {}, ""))["runs"][0];
  EXPECT_FALSE(without["tool"]["driver"].contains("informationUri"));
  EXPECT_FALSE(without["tool"]["driver"]["rules"][0].contains("helpUri"));
}

json RunOf(CaptureReport capture) {
  Report report = OneReport(std::move(capture));
  report.rules = kRules;
  return json::parse(WriteSarif(DigestOf(report)))["runs"][0];
}

// Written by hand from the OASIS standard, 3.27 (result) and 3.49 (reportingDescriptor).
constexpr std::string_view kRule = R"({
    "id": "al-refused",
    "shortDescription": {"text": "A state request was refused"},
    "fullDescription": {"text": "A state request was refused. Needs: AL status."},
    "help": {"text": "## What it checks\n\nRefusals.\n\n## Where it is shown\nThe line of a result is that of its first frame in the text that `ecaudit decode CAPTURE` writes.", "markdown": "## What it checks\n\nRefusals.\n\n## Where it is shown\nThe line of a result is that of its first frame in the text that `ecaudit decode CAPTURE` writes."},
    "defaultConfiguration": {"level": "error"},
    "properties": {"tags": ["AL state machine"], "source": "AKD-2011, 4.3"}})";

constexpr std::string_view kResult = R"json({
    "ruleId": "al-refused", "ruleIndex": 0, "level": "error",
    "message": {"text": "slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (frame 760). The slave stayed in PREOP. Check the output sync manager"},
    "locations": [{
      "physicalLocation": {"artifactLocation": {"uri": "lab/my%20akd.pcapng", "index": 0}, "region": {"startLine": 1}},
      "logicalLocations": [{"name": "slave 0", "fullyQualifiedName": "slave 0 (AKD, 0x1001)", "kind": "resource"}]}],
    "properties": {
      "frame": 760, "last_frame": 6762, "count": 5999, "time_s": 0.759,
      "time": "2019-05-01T12:00:00.759000000Z", "slave": 0, "station_address": 4097,
      "related_frames": [743], "confidence": "observed", "reference": "AKD EtherCAT Communication, 4.3",
      "wireshark_filter": "frame.number==760 || frame.number==6762 || frame.number==743"}})json";

constexpr std::string_view kArtifacts = R"([
    {"location": {"uri": "lab/my%20akd.pcapng"}, "roles": ["analysisTarget"]}])";

TEST(SarifWriter, ResultAndRule) {
  CaptureReport capture = RefusedSafeop();
  capture.result.capture.file.path = "lab/my akd.pcapng";
  const json run = RunOf(capture);
  EXPECT_EQ(run["tool"]["driver"]["name"], "ecaudit");
  EXPECT_EQ(run["tool"]["driver"]["semanticVersion"], "1.2.3");
  EXPECT_EQ(run["tool"]["driver"]["rules"][0], json::parse(kRule));
  json result = run["results"][0];
  const json& prints = result["partialFingerprints"];
  EXPECT_EQ(prints.size(), 2U);
  EXPECT_EQ(prints["primaryLocationLineHash"], prints["ecauditFinding/v1"]);
  result.erase("partialFingerprints");
  EXPECT_EQ(result, json::parse(kResult));
  EXPECT_EQ(run["artifacts"], json::parse(kArtifacts));
}

TEST(SarifWriter, RulesThatTheCatalogueLacksAreAdded) {
  const json run = RunOf(RefusedSafeop());  // "sync-lost" and "frame-lost" could not be judged
  const json& rules = run["tool"]["driver"]["rules"];
  for (const json& note : run["invocations"][0]["toolExecutionNotifications"]) {
    EXPECT_EQ(rules[note["associatedRule"]["index"].get<std::size_t>()]["id"], note["associatedRule"]["id"]);
  }
}

TEST(SarifWriter, BracesAreNoPlaceholders) {
  CaptureReport capture = RefusedSafeop();
  test::SetTexts(capture.result.findings[0], "name {0}");
  EXPECT_EQ(RunOf(capture)["results"][0]["message"]["text"], "slave 0 (AKD, 0x1001): name {{0}} (frame 760).");
}

TEST(SarifWriter, FingerprintsIgnoreFramesTimesAndCounts) {
  CaptureReport capture = RefusedSafeop();
  test::SetTexts(capture.result.findings[0], "4 frames of 181 never came back", "", "lost");
  const json before = RunOf(capture)["results"][0]["partialFingerprints"];
  CaptureReport later = capture;
  test::SetTexts(later.result.findings[0], "9 frames of 12 never came back", "", "lost");
  later.result.findings[0].first.number = 999;
  later.result.findings[0].count = 1;
  EXPECT_EQ(RunOf(later)["results"][0]["partialFingerprints"], before);
  // The hash is part of the interface: code-scanning views compare it with that of earlier versions.
  // FNV-1a of "al-refused\n0\nlost".
  EXPECT_EQ(before["ecauditFinding/v1"], "1636ba7984695b75:1");
}

TEST(SarifWriter, EqualFindingsOfOneCaptureAreCounted) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings.push_back(capture.result.findings[0]);
  const json results = RunOf(capture)["results"];
  const std::string first = results[0]["partialFingerprints"]["ecauditFinding/v1"];
  const std::string second = results[1]["partialFingerprints"]["ecauditFinding/v1"];
  EXPECT_EQ(first.substr(0, 17), second.substr(0, 17));
  EXPECT_TRUE(first.ends_with(":1"));
  EXPECT_TRUE(second.ends_with(":2"));
}

TEST(SarifWriter, CausesAreNamed) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings.push_back(MakeFinding("sdo-abort", Severity::kWarning, 7, 800, 0));
  const json result = RunOf(capture)["results"][1];
  EXPECT_EQ(result["level"], "warning");
  EXPECT_EQ(result["properties"]["caused_by"], "al-refused");
}

}  // namespace
}  // namespace ecaudit::report
