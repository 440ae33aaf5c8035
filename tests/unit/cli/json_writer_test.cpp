#include "cli/report/json_writer.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using nlohmann::json;
using test::Frame;
using test::MakeFinding;
using test::OneReport;
using test::RefusedSafeop;

json Written(CaptureReport capture) {
  return json::parse(WriteJson(OneReport(std::move(capture))));
}

TEST(JsonWriter, NamesSchemaAndTool) {
  const json document = Written(RefusedSafeop());
  EXPECT_EQ(document["schema"], "ecaudit.report/1");
  EXPECT_EQ(document["tool"], json({{"name", "ecaudit"}, {"version", "1.2.3"}}));
}

TEST(JsonWriter, CaptureSection) {
  const json capture = Written(RefusedSafeop())["reports"][0]["capture"];
  EXPECT_EQ(capture["path"], "akd.pcapng");
  EXPECT_EQ(capture["packets"], 6762);
  EXPECT_EQ(capture["direction"], "both");
  EXPECT_EQ(capture["first_time"], "2019-05-01T12:00:00.000000000Z");
  EXPECT_EQ(capture["last_time"], "2019-05-01T12:00:06.761000000Z");
  EXPECT_DOUBLE_EQ(capture["duration_s"], 6.761);
  EXPECT_EQ(capture["complete"], true);
  EXPECT_EQ(capture["damage"], nullptr);
}

TEST(JsonWriter, FindingAsInTheContract) {
  const json finding = Written(RefusedSafeop())["reports"][0]["findings"][0];
  EXPECT_EQ(finding["id"], "f1");
  EXPECT_EQ(finding["rule"], "al-refused");
  EXPECT_EQ(finding["severity"], "error");
  EXPECT_EQ(finding["slave"], 0);
  EXPECT_EQ(finding["station_address"], 4097);
  EXPECT_EQ(finding["frame"], 760);
  EXPECT_EQ(finding["last_frame"], 6762);
  EXPECT_EQ(finding["count"], 5999);
  EXPECT_EQ(finding["time"], "2019-05-01T12:00:00.759000000Z");
  EXPECT_DOUBLE_EQ(finding["time_s"], 0.759);
  EXPECT_EQ(finding["related_frames"], json::array({743}));
  EXPECT_EQ(finding["caused_by"], nullptr);
  EXPECT_EQ(finding["confidence"], "observed");
  EXPECT_EQ(finding["evidence"], json({{"al_status_code", 29},
                                       {"polls", 5999},

                                       {"mean_ms", 1.5},
                                       {"requested", "SAFEOP"}}));
  EXPECT_EQ(finding["reference"], json({{"document", "AKD EtherCAT Communication"}, {"section", "4.3"}}));
  EXPECT_EQ(finding["wireshark_filter"], "frame.number==760 || frame.number==6762 || frame.number==743");
  EXPECT_EQ(finding["known"], false);
}

TEST(JsonWriter, CauseIsNamedById) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings.push_back(MakeFinding("al-timeout", Severity::kError, kNoSlave, 800, 0));
  const json findings = Written(capture)["reports"][0]["findings"];
  EXPECT_EQ(findings[1]["id"], "f2");
  EXPECT_EQ(findings[1]["caused_by"], "f1");
  EXPECT_EQ(findings[1]["slave"], nullptr);
  EXPECT_EQ(findings[1]["station_address"], nullptr);
}

TEST(JsonWriter, SlaveWithHistory) {
  const json slave = Written(RefusedSafeop())["reports"][0]["slaves"][0];
  EXPECT_EQ(slave["position"], 0);
  EXPECT_EQ(slave["position_source"], "observed");
  EXPECT_EQ(slave["identity"]["product_code"], 0x00414B44);
  EXPECT_EQ(slave["identity"]["serial"], nullptr);
  EXPECT_EQ(slave["profile"], "kollmorgen-akd-2011");
  EXPECT_EQ(slave["al"]["state"], "PREOP");
  EXPECT_EQ(slave["al"]["error"], true);
  EXPECT_EQ(slave["al"]["status_code"], 29);
  const json history = slave["al"]["history"];
  ASSERT_EQ(history.size(), 3U);
  EXPECT_EQ(history[1]["kind"], "request");
  EXPECT_EQ(history[1]["to"], "SAFEOP");
  EXPECT_EQ(history[2]["frame"], 760);
  EXPECT_EQ(history[2]["from"], "PREOP");
  EXPECT_EQ(history[2]["to"], "PREOP");
  EXPECT_EQ(history[2]["error"], true);
  EXPECT_EQ(history[2]["status_code"], 29);
  EXPECT_TRUE(slave.at("dc").is_null()) << "a section that is not analysed is null, not invented";
}

TEST(JsonWriter, SlaveWithMailbox) {
  CaptureReport capture = RefusedSafeop();
  MailboxSummary& mailbox = capture.result.slaves[0].mailbox;
  mailbox = {52, 53, 40, 11, 2, 1, 3, 4, {{"CoE", 50, 51}, {"FoE", 2, 0}}};
  EXPECT_EQ(Written(capture)["reports"][0]["slaves"][0]["mailbox"],
            json({{"requests", 52},
                  {"responses", 53},
                  {"sdo_uploads", 40},
                  {"sdo_downloads", 11},
                  {"aborts", 2},
                  {"emergencies", 1},
                  {"error_replies", 3},
                  {"unanswered", 4},
                  {"by_protocol",
                   {{"CoE", {{"requests", 50}, {"responses", 51}}}, {"FoE", {{"requests", 2}, {"responses", 0}}}}}}));
  const json unused = Written(RefusedSafeop())["reports"][0]["slaves"][0]["mailbox"];
  EXPECT_EQ(unused["requests"], 0);
  EXPECT_EQ(unused["by_protocol"], json::object());
}

/// A step of nothing but its name.
StartupStep NamedStep(std::string name, FrameNo frame) {
  StartupStep step;
  step.name = std::move(name);
  step.frame = step.last = Frame(frame);
  return step;
}

TEST(JsonWriter, StepsThatSlavesHaveAlikeAreReportedOnce) {
  CaptureReport capture;
  for (const FrameNo frame : {10U, 20U, 30U}) {
    SlaveSummary& slave = capture.result.slaves.emplace_back();
    slave.position = static_cast<SlavePos>(capture.result.slaves.size() - 1);
    slave.startup.seen = true;
    slave.startup.steps = {NamedStep("own " + std::to_string(frame), frame), NamedStep("alike", frame + 1),
                           NamedStep("alike", frame + 2)};
  }
  capture.result.slaves[2].startup.steps.pop_back();
  capture.result.slaves[2].startup.steps.back().outcome = StartupOutcome::kRefused;
  const json report = Written(std::move(capture))["reports"][0];
  ASSERT_EQ(report["alike_steps"].size(), 1U);
  EXPECT_EQ(report["alike_steps"][0]["name"], "alike");
  EXPECT_EQ(report["alike_steps"][0]["slaves"], json::array({0, 1}));
  const auto steps_of = [&](std::size_t slave) { return report["slaves"][slave]["startup"]["steps"]; };
  EXPECT_EQ(steps_of(0)[0]["name"], "own 10");
  EXPECT_FALSE(steps_of(0)[0].contains("alike"));
  for (const std::size_t i : {1U, 2U}) {
    EXPECT_EQ(steps_of(1)[i]["alike"], 0);
    EXPECT_EQ(steps_of(1)[i]["frame"], 20 + i);
    EXPECT_FALSE(steps_of(1)[i].contains("name"));
  }
  EXPECT_EQ(steps_of(2)[1]["outcome"], "refused") << "told by itself: not alike";
}

TEST(JsonWriter, NothingKnownIsNull) {
  CaptureReport capture;
  capture.result.slaves.push_back({});
  const json report = Written(capture)["reports"][0];
  EXPECT_EQ(report["capture"]["first_time"], nullptr);
  EXPECT_EQ(report["capture"]["duration_s"], nullptr);
  EXPECT_EQ(report["capture"]["direction"], nullptr);
  EXPECT_EQ(report["capture"]["timestamp_resolution_ns"], nullptr);
  EXPECT_EQ(report["bus"]["slave_count"], nullptr);
  EXPECT_EQ(report["bus"]["cycle"]["mean_us"], nullptr);
  EXPECT_EQ(report["slaves"][0]["station_address"], nullptr);
  EXPECT_EQ(report["slaves"][0]["name"], nullptr);
  EXPECT_EQ(report["slaves"][0]["al"]["state"], nullptr);
  EXPECT_EQ(report["slaves"][0]["al"]["error"], nullptr);
}

TEST(JsonWriter, NotEvaluable) {
  const json entries = Written(RefusedSafeop())["reports"][0]["not_evaluable"];
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0]["rule"], "sync-lost");
  EXPECT_EQ(entries[0]["slave"], 0);
  EXPECT_EQ(entries[0]["reason"], "DC is not in the capture");
  EXPECT_EQ(entries[0]["code"], "not-in-capture");
  EXPECT_EQ(entries[0]["what"], "DC");
  EXPECT_EQ(entries[0]["first_frame"], nullptr);
  EXPECT_EQ(entries[1]["slave"], nullptr);
  EXPECT_EQ(entries[1]["first_frame"], 6000);
}

TEST(JsonWriter, CoverageIsCountedByRuleAndChapter) {
  CaptureReport capture = RefusedSafeop();
  capture.result.slaves.push_back(test::MakeSlave(9, 1, 0x1002, "B"));
  capture.result.coverage = {
      {"al-refused", "AL state machine", {{7, Coverage::kJudged, {}}, {9, Coverage::kPartly, {}}}},
      {"frame-lost", "Frame and bus", {{kNoSlave, Coverage::kNotJudged, {}}}},
      {"sdo-abort",
       "Mailbox and CoE",
       {{7, Coverage::kNotApplicable, NotApplicable::kNoCoe}, {9, Coverage::kNotApplicable, NotApplicable::kNoCoe}}}};
  capture.result.capture_next = {{"both directions", 4}};
  const json report = Written(capture)["reports"][0];
  const json& coverage = report["coverage"];
  EXPECT_EQ(coverage["judged"], 1);
  EXPECT_EQ(coverage["partly"], 1);
  EXPECT_EQ(coverage["not_judged"], 1);
  EXPECT_EQ(coverage["not_applicable"], 2);
  ASSERT_EQ(coverage["by_chapter"].size(), 3U);
  EXPECT_EQ(
      coverage["by_chapter"][0],
      json({{"chapter", "Frame and bus"}, {"judged", 0}, {"partly", 0}, {"not_judged", 1}, {"not_applicable", 0}}));
  EXPECT_EQ(coverage["rules"][0]["slaves"],
            json({{"judged", {0}}, {"partly", {1}}, {"not_judged", json::array()}, {"not_applicable", json::array()}}));
  EXPECT_EQ(coverage["rules"][1]["slaves"], nullptr);
  EXPECT_EQ(coverage["rules"][2]["not_applicable_because"], "the mailbox is not used for CoE");
  EXPECT_EQ(report["capture_next"], json::array({{{"what", "both directions"}, {"judgements", 4}}}));
}

TEST(JsonWriter, SummaryLeavesKnownFindingsOut) {
  CaptureReport capture = RefusedSafeop();
  capture.known = {true};
  const json document = Written(capture);
  EXPECT_EQ(document["reports"][0]["summary"], json({{"errors", 0},
                                                     {"warnings", 0},
                                                     {"infos", 0},
                                                     {"known", 1},
                                                     {"verdict", "pass"},
                                                     {"limited_because", nullptr},
                                                     {"reservations", json::array()}}));
  EXPECT_EQ(document["summary"]["captures"], 1);
  EXPECT_EQ(document["summary"]["verdict"], "pass");
  EXPECT_EQ(document["reports"][0]["findings"][0]["known"], true);
}

TEST(JsonWriter, UntrustedTextIsMadePrintable) {
  CaptureReport capture = RefusedSafeop();
  capture.result.slaves[0].name = "A\x1b[31mKD\x80\xB5";
  test::SetTexts(capture.result.findings[0], "title", "first line\nsecond\x07");
  const std::string text = WriteJson(OneReport(capture));
  for (const char c : text) EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
  const json document = json::parse(text);
  EXPECT_EQ(document["reports"][0]["slaves"][0]["name"], "A\\x1b[31mKD\\x80µ");
  EXPECT_EQ(document["reports"][0]["findings"][0]["message"], "first line second\\x07");
}

}  // namespace
}  // namespace ecaudit::report
