#include "cli/capture_options.h"

#include <gtest/gtest.h>

#include "tests/unit/cli/temp_dir.h"

namespace ecaudit::cli {
namespace {

using test::TempDir;

TEST(CaptureOptions, SlaveByPositionOrAddress) {
  const auto position = ParseSlave("12");
  ASSERT_TRUE(position);
  EXPECT_FALSE(position->by_address);
  EXPECT_EQ(position->value, 12);
  const auto address = ParseSlave("0x1001");
  ASSERT_TRUE(address);
  EXPECT_TRUE(address->by_address);
  EXPECT_EQ(address->value, 0x1001);
  for (const char* text : {"", "x", "0x", "-1", "65536", "0x10000", "1 ", "+1"}) EXPECT_FALSE(ParseSlave(text)) << text;
}

TEST(CaptureOptions, SlavesAsCountedFromOne) {
  constexpr SlaveNames kFromOne{.from_one = true};
  EXPECT_EQ(ParseSlave("1", kFromOne)->value, 0);
  EXPECT_EQ(ParseShownSlave("12", kFromOne)->value, 11);
  EXPECT_EQ(ParseSlave("0x1001", kFromOne)->value, 0x1001);
  EXPECT_FALSE(ParseSlave("0", kFromOne));

  AnalysisOptions analysis;
  analysis.slave_names = kFromOne;
  EXPECT_FALSE(AddProfile("2=generic", analysis));
  EXPECT_EQ(analysis.slave_profiles.at(0).first.value, 1);
  EXPECT_FALSE(AddParameter("3:PTBASE=8", analysis));
  EXPECT_EQ(analysis.parameters.at(0).slave->value, 2);
}

TEST(CaptureOptions, AFileCountsSlavesAsItStatesItself) {
  const TempDir folder;
  const std::string path = folder.Write(".ecaudit.json", R"({"count_from": 1, "slave_profiles": {"1": "generic"}})");
  CaptureOptions options;
  options.config = path;
  options.slaves = {"2"};
  Result<Settings> settings = ResolveSettings(options, {}, "a.pcapng");
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_TRUE(settings->analysis.slave_names.from_one);
  EXPECT_EQ(settings->analysis.slave_profiles.at(0).first.value, 0);
  EXPECT_EQ(settings->slaves.at(0).value, 1);

  // The option wins for what is typed and shown; the file keeps its meaning.
  options.count_from = "0";
  settings = ResolveSettings(options, {}, "a.pcapng");
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_FALSE(settings->analysis.slave_names.from_one);
  EXPECT_EQ(settings->analysis.slave_profiles.at(0).first.value, 0);
  EXPECT_EQ(settings->slaves.at(0).value, 2);

  for (const char* wrong : {"2", "", "one", "-1"}) {
    options.count_from = wrong;
    EXPECT_FALSE(ResolveSettings(options, {}, "a.pcapng")) << wrong;
  }
}

TEST(CaptureOptions, RuleSettings) {
  AnalysisOptions analysis;
  EXPECT_FALSE(AddRuleSetting("al-timeout=off", analysis));
  EXPECT_TRUE(analysis.rules.at("al-timeout").off);
  EXPECT_FALSE(AddRuleSetting("al-timeout=info", analysis));
  EXPECT_FALSE(analysis.rules.at("al-timeout").off);
  EXPECT_EQ(analysis.rules.at("al-timeout").severity, Severity::kInfo);
  EXPECT_TRUE(AddRuleSetting("al-timeout", analysis));
  EXPECT_TRUE(AddRuleSetting("al-timeout=", analysis));
  EXPECT_TRUE(AddRuleSetting("=off", analysis));
  EXPECT_TRUE(AddRuleSetting("no-such-rule=off", analysis));
}

TEST(CaptureOptions, LaterProfilesReplaceEarlierOnes) {
  AnalysisOptions analysis;
  EXPECT_FALSE(AddProfile("0x1001=generic", analysis));
  EXPECT_FALSE(AddProfile("0=generic", analysis));
  EXPECT_FALSE(AddProfile("0x1001=kollmorgen-mkd-n", analysis));
  EXPECT_FALSE(AddProfile("pilz-pmcprotego-d", analysis));
  EXPECT_EQ(analysis.default_profile, "pilz-pmcprotego-d");
  ASSERT_EQ(analysis.slave_profiles.size(), 2U);
  EXPECT_EQ(analysis.slave_profiles[1].second, "kollmorgen-mkd-n");
  EXPECT_TRUE(AddProfile("x=generic", analysis));
  EXPECT_TRUE(AddProfile("no-such-profile", analysis));
}

TEST(CaptureOptions, ParametersOfDrives) {
  AnalysisOptions analysis;
  EXPECT_FALSE(AddParameter("FBUS.SYNCDIST=500", analysis));
  EXPECT_FALSE(AddParameter("0x1001:PTBASE=0x10", analysis));
  ASSERT_EQ(analysis.parameters.size(), 2U);
  EXPECT_FALSE(analysis.parameters[0].slave);
  EXPECT_EQ(analysis.parameters[0].keyword, "FBUS.SYNCDIST");
  EXPECT_EQ(analysis.parameters[0].value, 500);
  EXPECT_EQ(analysis.parameters[1].slave->value, 0x1001);
  EXPECT_EQ(analysis.parameters[1].value, 16);
  for (const char* text : {"FBUS.SYNCDIST", "FBUS.SYNCDIST=", "FBUS.SYNCDIST=-1", "FBUS.SYNCDIST=1.5", "FBUS.SYNC=1",
                           "x:PTBASE=8", "=8", "PTBASE=4294967296"}) {
    EXPECT_TRUE(AddParameter(text, analysis)) << text;
  }
  EXPECT_EQ(analysis.parameters.size(), 2U);
}

TEST(CaptureOptions, CommandLineWinsOverTheFile) {
  const TempDir dir;
  dir.Write(".ecaudit.json", R"({"profile": "generic", "slave_profiles": {"0": "generic"}, "fail_on": "never",
    "rules": {"al-timeout": "off", "al-refused": "info"}, "baseline": "b.json", "limits": {"al-timeout.down": 1}})");
  CaptureOptions options;
  GateOptions gate;
  const auto from_file = ResolveSettings(options, gate, dir.Path("x.pcap"));
  ASSERT_TRUE(from_file) << from_file.error().message;
  EXPECT_EQ(from_file->fail_on, report::FailOn::kNever);
  EXPECT_EQ(from_file->baseline, dir.Path("b.json"));
  EXPECT_EQ(from_file->analysis.limits.at("al-timeout.down"), 1'000'000);

  options.profiles = {"kollmorgen-mkd-n", "0=pilz-pmcprotego-d"};
  gate.rules = {"al-timeout=error"};
  gate.fail_on = "warning";
  gate.baseline = "other.json";
  const auto both = ResolveSettings(options, gate, dir.Path("x.pcap"));
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->analysis.default_profile, "kollmorgen-mkd-n");
  ASSERT_EQ(both->analysis.slave_profiles.size(), 1U);
  EXPECT_EQ(both->analysis.slave_profiles[0].second, "pilz-pmcprotego-d");
  EXPECT_FALSE(both->analysis.rules.at("al-timeout").off);
  EXPECT_EQ(both->analysis.rules.at("al-refused").severity, Severity::kInfo);
  EXPECT_EQ(both->fail_on, report::FailOn::kWarning);
  EXPECT_EQ(both->baseline, "other.json");
}

}  // namespace
}  // namespace ecaudit::cli
