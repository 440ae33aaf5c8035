#include "analyzers/judge/one_for_many.h"

#include <gtest/gtest.h>

#include "cli/report/sentences.h"
#include "tests/support/findings.h"

namespace ecaudit {
namespace {

std::string Name(SlaveId slave) {
  return "s" + std::to_string(slave);
}

SlavePos Place(SlaveId slave) {
  return static_cast<SlavePos>(slave < 20 ? slave : slave + 10);
}

Finding Of(std::string_view rule, SlaveId slave, FrameNo frame, const std::string& title,
           FindingIndex cause = kNoFinding) {
  Finding finding;
  finding.rule = rule;
  finding.slave = slave;
  finding.severity = Severity::kError;
  test::SetTexts(finding, title, "It did.", "same");
  finding.first.number = finding.last.number = frame;
  finding.caused_by = cause;
  return finding;
}

/// A pause that `slaves` slaves have, and the fall of each.
std::vector<Finding> Pause(SlaveId slaves, FrameNo apart) {
  std::vector<Finding> findings;
  for (SlaveId s = 0; s < slaves; ++s) {
    findings.push_back(Of("gap", s, 100 + apart * s, "Paused for " + std::to_string(200 + s) + ".5 ms"));
    findings.push_back(Of("fell", s, 5000 + 900 * s, "Left OP, code 0x001b", static_cast<FindingIndex>(2 * s)));
  }
  return findings;
}

TEST(OneForMany, OnePauseIsOneFindingOfTheBus) {
  std::vector<Finding> findings = Pause(40, 2);
  findings.insert(findings.begin(), Of("other", 3, 1, "Alone"));
  for (Finding& finding : findings) {
    if (finding.caused_by != kNoFinding) ++finding.caused_by;
  }
  JoinSlaves(findings, Name, Place);
  ASSERT_EQ(findings.size(), 3U);
  EXPECT_EQ(findings[0].slave, 3U);
  EXPECT_EQ(findings[1].slave, kNoSlave);
  EXPECT_EQ(report::TitleOf(findings[1]), "Paused for 200.5 ms (40 slaves)");
  EXPECT_EQ(report::MessageOf(findings[1], {}),
            "40 slaves are affected: s0, s1, s2, s3, s4, s5, s6, s7 and 32 more. For s0: It did.");
  EXPECT_EQ(findings[1].last.number, 178U);
  EXPECT_EQ(findings[1].affected.number, 40U);
  EXPECT_EQ(findings[1].affected.positions, "0-19, 30-49");
  EXPECT_EQ(findings[2].rule, "fell");
  EXPECT_EQ(findings[2].slave, kNoSlave);
  EXPECT_EQ(findings[2].caused_by, 1U);
}

TEST(OneForMany, AFewSlavesSpeakForThemselves) {
  std::vector<Finding> findings = Pause(static_cast<SlaveId>(kManySlaves - 1), 2);
  const std::size_t before = findings.size();
  JoinSlaves(findings, Name, Place);
  EXPECT_EQ(findings.size(), before);
  EXPECT_EQ(findings[0].slave, 0U);
}

TEST(OneForMany, WhatHappensAtDifferentTimesIsNotOneMatter) {
  std::vector<Finding> findings = Pause(40, 1000);
  JoinSlaves(findings, Name, Place);
  EXPECT_EQ(findings.size(), 80U);
}

TEST(OneForMany, OtherCodesAreOtherMatters) {
  std::vector<Finding> findings;
  for (SlaveId s = 0; s < 20; ++s) {
    findings.push_back(Of("fell", s, 100, "Left OP"));
    test::SetTexts(findings.back(), "Left OP", "", s < 5 ? "0x001b" : "0x001a");
  }
  JoinSlaves(findings, Name, Place);
  ASSERT_EQ(findings.size(), 6U);
  EXPECT_EQ(report::TitleOf(findings[5]), "Left OP (15 slaves)");
}

}  // namespace
}  // namespace ecaudit
