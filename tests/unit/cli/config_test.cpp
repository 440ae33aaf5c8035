#include "cli/config.h"

#include <gtest/gtest.h>

#include "tests/unit/cli/temp_dir.h"

namespace ecaudit::cli {
namespace {

using test::TempDir;

TEST(Config, ReadsAllKeys) {
  const TempDir dir;
  const std::string path = dir.Write(".ecaudit.json", R"({
    "profile": "generic", "slave_profiles": {"0x1001": "kollmorgen-mkd-n"},
    "rules": {"al-timeout": "warning", "sdo-abort": "off"}, "fail_on": "warning", "baseline": "known.json",
    "require": "judged", "limits": {"al-timeout.preop": 2500.5} })");
  const auto config = ReadConfig(path);
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->profiles, (std::vector<std::string>{"generic", "0x1001=kollmorgen-mkd-n"}));
  EXPECT_EQ(config->rules, (std::vector<std::string>{"al-timeout=warning", "sdo-abort=off"}));
  EXPECT_EQ(config->fail_on, "warning");
  EXPECT_EQ(config->require, "judged");
  EXPECT_EQ(config->limits.at("al-timeout.preop"), 2'500'500'000) << "nanoseconds";
  EXPECT_EQ(config->baseline, dir.Path("known.json")) << "relative to the file, not to the current folder";
}

std::string ErrorOf(std::string_view content) {
  const TempDir dir;
  const auto config = ReadConfig(dir.Write("c.json", content));
  if (config) return "no error";
  const std::string& message = config.error().message;
  const std::string prefix = dir.Path("c.json");
  return message.starts_with(prefix) ? message.substr(prefix.size()) : "no path: " + message;
}

TEST(Config, ReportsWhatIsWrong) {
  EXPECT_EQ(ErrorOf(R"({"rule": {}})"), ": unknown key 'rule' (did you mean 'rules'?)");
  EXPECT_EQ(ErrorOf(R"({"colour": 1})"), ": unknown key 'colour'");
  EXPECT_EQ(ErrorOf(R"({"count_from": "1"})"), ": 'count_from' must be 0 or 1");
  EXPECT_EQ(ErrorOf(R"({"rules": ["a"]})"), ": 'rules' must be an object");
  EXPECT_EQ(ErrorOf(R"({"rules": {"a": 1}})"), ": 'rules': the value of 'a' must be a string");
  EXPECT_EQ(ErrorOf(R"({"fail_on": 1})"), ": 'fail_on' must be a string");
  EXPECT_EQ(ErrorOf(R"({"limits": {"al-timeout.preopp": 1}})"),
            ": unknown limit 'al-timeout.preopp' (did you mean 'al-timeout.preop'?)");
  for (const char* value : {"0", "-1", "1e99", "\"3 s\"", "null"}) {
    EXPECT_EQ(ErrorOf(std::string(R"({"limits": {"al-timeout.preop": )") + value + "}}"),
              ": 'limits': the value of 'al-timeout.preop' must be a number of milliseconds");
  }
  EXPECT_EQ(ErrorOf("[]"), ": the document must be an object");
}

TEST(Config, ReportsWhereJsonEnds) {
  EXPECT_EQ(ErrorOf("{\n  \"rules\": {,}\n}"), ":2:13: not valid JSON");
  EXPECT_EQ(ErrorOf(""), ":1:1: not valid JSON");
}

TEST(Config, MissingFile) {
  const auto config = ReadConfig("/nonexistent/c.json");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().message, "no such file: /nonexistent/c.json");
}

TEST(Config, FoundBesideTheCaptureOrAbove) {
  const TempDir dir;
  const std::string above = dir.Write(".ecaudit.json", "{}");
  const std::string capture = dir.Write("a/b/x.pcap", "");
  EXPECT_EQ(FindConfig(capture), above);
  const std::string nearer = dir.Write("a/.ecaudit.json", "{}");
  EXPECT_EQ(FindConfig(capture), nearer);
}

TEST(Config, NotFound) {
  const TempDir dir;
  const std::string capture = dir.Write("x.pcap", "");
  EXPECT_EQ(FindConfig(capture), std::nullopt);
}

}  // namespace
}  // namespace ecaudit::cli
