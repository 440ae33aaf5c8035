#include "cli/report/html_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/report/json_writer.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// What stands in the page as data.
std::string DataOf(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = page.find(begin) + begin.size();
  return page.substr(from, page.find("</script>", from) - from);
}

class HtmlWriter : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!MissingHtml().empty()) GTEST_SKIP() << MissingHtml();
    report_.version = "1.2.3";
    report_.captures.push_back(test::RefusedSafeop());
  }
  Report report_;
};

TEST_F(HtmlWriter, HoldsTheJsonReport) {
  const std::string page = WriteHtml(report_);
  EXPECT_THAT(page, HasSubstr("<title>akd.pcapng - ecaudit</title>"));
  const auto data = nlohmann::ordered_json::parse(DataOf(page));
  EXPECT_EQ(data["report"], nlohmann::ordered_json::parse(WriteJson(report_)));
  EXPECT_EQ(data["pages"][0]["verdict"], "FAIL");
  EXPECT_EQ(data["pages"][0]["timeline"], nullptr);
  EXPECT_EQ(data["pages"][0]["order"].size(), report_.captures[0].result.findings.size());
}

TEST_F(HtmlWriter, NoTextOfTheCaptureBecomesMarkup) {
  AnalysisResult& result = report_.captures[0].result;
  result.slaves[0].name = "</script><script>alert(1)</script><!--";
  result.capture.file.path = "<img src=x>&.pcapng";
  test::SetTexts(result.findings[0], "</title></noscript><b>");
  const std::string page = WriteHtml(report_);
  EXPECT_THAT(DataOf(page), Not(HasSubstr("<")));
  EXPECT_EQ(nlohmann::ordered_json::parse(DataOf(page))["report"], nlohmann::ordered_json::parse(WriteJson(report_)));
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, Not(HasSubstr("<b>")));
  EXPECT_THAT(page, HasSubstr("&lt;img src=x&gt;&amp;.pcapng - ecaudit"));
}

TEST_F(HtmlWriter, MarksInTextsAreNoMarks) {
  report_.captures[0].result.capture.file.path = std::string(kDataMark) + std::string(kSummaryMark);
  const std::string page = WriteHtml(report_);
  EXPECT_EQ(nlohmann::ordered_json::parse(DataOf(page))["report"], nlohmann::ordered_json::parse(WriteJson(report_)));
}

TEST_F(HtmlWriter, SeriesOverTime) {
  auto timeline = std::make_shared<Timeline>();
  const SlaveSummary& slave = report_.captures[0].result.slaves[0];
  CaptureSummary& capture = report_.captures[0].result.capture;
  capture.origin = capture.first = test::Frame(1);
  SlaveTimeline& lane = timeline->slaves.emplace_back();
  lane.slave = slave.id;
  lane.mailbox = {test::kStart + 500'000'000, 1000, {{0, 0, 2}, {0, 0, 0}, {0, 0, 5}}};
  lane.signals.push_back({true,
                          0x6040,
                          0,
                          16,
                          "Control word",
                          false,
                          "",
                          false,
                          {test::kStart, 2'000'000, {{1, 1, 1}, {2.5, 7, 2}}},
                          {{7, test::kStart + 1'000'000, 1}, {8, test::kStart + 2'000'000, 2.5}},
                          "Axis X.Control word"});
  lane.signals.push_back(lane.signals.back());
  for (CloseValue& value : lane.signals.back().close) value.value = 4;
  lane.signals.back().word = true;
  lane.signals.back().values.buckets = {{4, 4, 1, 4, 4}, {3, 5, 2, 7, 1}};
  timeline->frames = {test::kStart, 1000, {{7, 9, 3}, {10, 10, 1}}};
  report_.captures[0].timeline = timeline;
  const auto data = nlohmann::ordered_json::parse(DataOf(WriteHtml(report_)))["pages"][0]["timeline"];
  EXPECT_EQ(data["frames"], nlohmann::ordered_json::parse(R"({"start_s": 0.0, "width_s": 1e-06, "least": [7, 10]})"));
  EXPECT_EQ(data["lost"], nullptr);
  const auto& drawn = data["slaves"][0];
  EXPECT_EQ(drawn["slave"], slave.position);
  EXPECT_EQ(drawn["mailbox"], nlohmann::ordered_json::parse(R"({"start_s": 0.5, "width_s": 1e-06, "at": [0, 2],
                                                                "count": [2, 5]})"));
  EXPECT_EQ(drawn["signals"][0]["values"], nlohmann::ordered_json::parse(R"({"start_s": 0.0, "width_s": 0.002,
                                                                "least": [1, 2.5], "most": [1, 7]})"));
  EXPECT_EQ(drawn["signals"][0]["word"], false);
  EXPECT_EQ(drawn["signals"][1]["word"], true);
  EXPECT_EQ(drawn["signals"][1]["values"]["any"], nlohmann::ordered_json::parse("[4, 7]"));
  EXPECT_EQ(drawn["signals"][1]["values"]["all"], nlohmann::ordered_json::parse("[4, 1]"));
  // What is around findings: the frames once for all signals that they carry, and one number for what does not change.
  EXPECT_EQ(drawn["close"], nlohmann::ordered_json::parse(R"([{"frames": [7, 8], "time_s": [0.001, 0.002]}])"));
  EXPECT_EQ(drawn["signals"][0]["close"], nlohmann::ordered_json::parse(R"({"at": 0, "values": [1, 2.5]})"));
  EXPECT_EQ(drawn["signals"][1]["close"], nlohmann::ordered_json::parse(R"({"at": 0, "value": 4})"));
}

TEST_F(HtmlWriter, LargeDataArePacked) {
  for (int i = 0; i < 400; ++i) report_.captures.push_back(test::RefusedSafeop());
  const std::string plain = WriteJson(report_);
  const std::string page = WriteHtml(report_);
  const auto data = nlohmann::ordered_json::parse(DataOf(page));
  ASSERT_TRUE(data.contains("packed"));
  EXPECT_LT(page.size(), plain.size() / 3);
}

}  // namespace
}  // namespace ecaudit::report
