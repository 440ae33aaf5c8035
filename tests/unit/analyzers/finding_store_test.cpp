#include "analyzers/judge/finding_store.h"

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "analyzers/result/every_slave.h"
#include "tests/support/reasons.h"

namespace ecaudit {
namespace {

constexpr RuleInfo kRule{.id = "al-refused",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .title = "t",
                         .needs = "n",
                         .source = "ETG1000.6, AL Status, 0x0130; ETG1020, codes",
                         .doc = ""};
constexpr RuleInfo kOther{.id = "al-timeout",
                          .group = "AL state machine",
                          .severity = Severity::kWarning,
                          .title = "t",
                          .needs = "n",
                          .source = "ETG2000",
                          .doc = ""};

class FindingStoreTest : public ::testing::Test {
 protected:
  static Finding At(FrameNo frame, SlaveId slave = 0) {
    Finding finding;
    finding.slave = slave;
    finding.first = {frame, 0, false};
    return finding;
  }
  std::map<std::string, RuleSetting, std::less<>> settings;
  FindingStore store{settings};
};

TEST_F(FindingStoreTest, FillsInWhatTheRuleKnows) {
  const FindingIndex index = store.Add(kRule, 1, At(7));
  ASSERT_NE(index, kNoFinding);
  EXPECT_EQ(store[index].rule, "al-refused");
  EXPECT_EQ(store[index].severity, Severity::kError);
  EXPECT_EQ(store[index].last.number, 7U);
  EXPECT_EQ(store[index].reference.document, "ETG1000.6");
  EXPECT_EQ(store[index].reference.section, "AL Status, 0x0130");
}

TEST_F(FindingStoreTest, KeepsAReferenceThatIsSet) {
  Finding finding = At(7);
  finding.reference = ReferenceTo("AKD-2011, 4.3.4; MKD, 4.3.4");
  const FindingIndex index = store.Add(kRule, 1, std::move(finding));
  EXPECT_EQ(store[index].reference.document, "AKD-2011");
  EXPECT_EQ(store[index].reference.section, "4.3.4");
}

TEST_F(FindingStoreTest, ReferenceToAWholeDocument) {
  const FindingIndex index = store.Add(kOther, 1, At(7));
  EXPECT_EQ(store[index].reference.document, "ETG2000");
  EXPECT_EQ(store[index].reference.section, "");
  EXPECT_EQ(ReferenceTo("").document, "");
}

TEST_F(FindingStoreTest, RepetitionsCountBySlaveAndKey) {
  EXPECT_EQ(store.Repeat(kRule, 0, 1, {3, 0, false}), kNoFinding);
  const FindingIndex first = store.Add(kRule, 1, At(3, 0));
  EXPECT_EQ(store.Repeat(kRule, 0, 1, {5, 0, false}), first);
  EXPECT_EQ(store.Repeat(kRule, 1, 1, {6, 0, false}), kNoFinding);
  EXPECT_EQ(store.Repeat(kRule, 0, 2, {7, 0, false}), kNoFinding);
  EXPECT_EQ(store.Repeat(kOther, 0, 1, {8, 0, false}), kNoFinding);
  EXPECT_EQ(store[first].count, 2U);
  EXPECT_EQ(store[first].last.number, 5U);
}

TEST_F(FindingStoreTest, SettingsOfTheUserWin) {
  settings["al-refused"] = {.off = true, .severity = Severity::kError};
  settings["al-timeout"] = {.off = false, .severity = Severity::kInfo};
  EXPECT_EQ(store.Add(kRule, 1, At(3)), kNoFinding);
  const FindingIndex index = store.Add(kOther, 1, Severity::kError, At(4));
  EXPECT_EQ(store[index].severity, Severity::kInfo);
  store.AddNotEvaluable(kRule, 0, test::Because("why"), 1);
  EXPECT_TRUE(store.not_evaluable().empty());
}

TEST_F(FindingStoreTest, TooManyDifferentFindingsAreCountedOnTheLast) {
  FindingIndex last = kNoFinding;
  for (std::uint64_t key = 0; key < FindingStore::kMaxPerRuleAndSlave; ++key) last = store.Add(kRule, key, At(key + 1));
  EXPECT_EQ(store.Add(kRule, 1000, At(500)), last);
  EXPECT_EQ(store.findings().size(), FindingStore::kMaxPerRuleAndSlave);
  EXPECT_EQ(store[last].count, 2U);
  EXPECT_EQ(store[last].last.number, 500U);
  EXPECT_NE(store.Add(kRule, 1000, At(501, 1)), last) << "another slave has its own number";
}

TEST_F(FindingStoreTest, WhenThereAreTooManyTheFirstOfEachSlaveIsKeptNevertheless) {
  SlaveId slave = 0;
  for (; store.findings().size() < FindingStore::kMaxFindings; ++slave) {
    for (std::uint64_t key = 0; key < FindingStore::kMaxPerRuleAndSlave; ++key) store.Add(kRule, key, At(1, slave));
  }
  const FindingIndex first = store.Add(kRule, 1, At(2, slave));
  ASSERT_NE(first, kNoFinding);
  EXPECT_EQ(store.Add(kRule, 2, At(3, slave)), first);
  EXPECT_EQ(store[first].count, 2U);
  for (std::uint64_t other = 1; other < 2 * FindingStore::kMaxWithFirstOnes; ++other) {
    store.Add(kRule, 1, At(4, static_cast<SlaveId>(slave + other)));
  }
  EXPECT_EQ(store.findings().size(), FindingStore::kMaxWithFirstOnes);
  EXPECT_EQ(store.findings_left_out(), 1U + 2 * FindingStore::kMaxWithFirstOnes - 1 -
                                           (FindingStore::kMaxWithFirstOnes - FindingStore::kMaxFindings - 1));
}

TEST_F(FindingStoreTest, AnErrorBehindAnyNumberOfWarningsIsListed) {
  for (SlaveId slave = 0; slave < 2 * FindingStore::kMaxWithFirstOnes; ++slave) {
    store.Add(kRule, 1, Severity::kWarning, At(slave + 1, slave));
  }
  EXPECT_EQ(store.findings().size(), FindingStore::kMaxWithFirstOnes);
  const FindingIndex of_rule = store.Add(kRule, 2, Severity::kError, At(50'000, 7));
  ASSERT_NE(of_rule, kNoFinding);
  EXPECT_EQ(store[of_rule].severity, Severity::kError);
  EXPECT_EQ(store[of_rule].first.number, 50'000U);
  const FindingIndex of_other = store.Add(kOther, 1, Severity::kError, At(50'001, 8));
  EXPECT_EQ(store[of_other].first.number, 50'001U);
}

TEST_F(FindingStoreTest, TheFirstFindingOfARuleHasRoomWhenAllElseIsFull) {
  for (SlaveId slave = 0; slave < 2 * FindingStore::kMaxWithFirstOnes; ++slave) {
    store.Add(kRule, 1, Severity::kError, At(slave + 1, slave));
  }
  const FindingIndex first = store.Add(kOther, 1, Severity::kError, At(60'000, 8));
  ASSERT_NE(first, kNoFinding);
  EXPECT_EQ(store[first].rule, kOther.id);
  EXPECT_EQ(store.Add(kOther, 1, Severity::kError, At(60'001, 9)), first) << "counted on it, not lost";
  EXPECT_EQ(store[first].count, 2U);
}

TEST_F(FindingStoreTest, NotEvaluableOncePerReason) {
  store.AddNotEvaluable(kRule, 0, test::Because("why"), 7);
  store.AddNotEvaluable(kRule, 0, test::Because("why"), 9);
  store.AddNotEvaluable(kRule, 0, test::Because("another"), 9);
  ASSERT_EQ(store.not_evaluable().size(), 2U);
  EXPECT_EQ(store.not_evaluable()[0].first_frame, 7U);
  EXPECT_EQ(store.not_evaluable()[0].occasions, 2U);
}

TEST_F(FindingStoreTest, WhatHoldsForAllSlavesIsOneEntry) {
  for (const SlaveId slave : {SlaveId{0}, SlaveId{1}, SlaveId{2}})
    store.AddNotEvaluable(kRule, slave, test::Because("all"), 5U + slave);
  store.AddNotEvaluable(kRule, 1, test::Because("one"), 2);
  store.AddNotEvaluable(kOther, kNoSlave, test::Because("all"), 0);
  store.FoldNotEvaluable(3);
  ASSERT_EQ(store.not_evaluable().size(), 3U);
  EXPECT_EQ(store.not_evaluable()[0].slave, kEverySlave);
  EXPECT_EQ(store.not_evaluable()[0].reason, test::Because("all"));
  EXPECT_EQ(store.not_evaluable()[0].first_frame, 5U);
  EXPECT_EQ(store.not_evaluable()[0].occasions, 3U);
  EXPECT_EQ(store.not_evaluable()[1].slave, 1);
  EXPECT_EQ(store.not_evaluable()[2].rule, "al-timeout");
  EXPECT_EQ(store.not_evaluable()[2].slave, kNoSlave) << "the bus itself";
}

TEST_F(FindingStoreTest, WhatHoldsForAllSlavesIsOneEntryHoweverManySlavesThereAre) {
  constexpr SlaveId kSlaves = 2048;
  for (SlaveId slave = 0; slave < kSlaves; ++slave) {
    store.AddNotEvaluable(kRule, slave, test::Because("why"), 7);
    store.AddNotEvaluable(kOther, slave, test::Because("why not"), 9);
  }
  store.AddNotEvaluable(kRule, 5, test::Because("why"), 9);
  EXPECT_EQ(store.not_evaluable().size(), 2U * kSlaves);
  store.FoldNotEvaluable(kSlaves);
  ASSERT_EQ(store.not_evaluable().size(), 2U);
  EXPECT_EQ(store.not_evaluable()[0].slave, kEverySlave);
  EXPECT_EQ(store.not_evaluable()[0].occasions, kSlaves + 1U) << "what is listed goes on counting";
  EXPECT_EQ(store.lines_left_out(), 0U);
}

TEST_F(FindingStoreTest, WhatHoldsForMoreSlavesThanAreListedIsOneEntryThatCountsThem) {
  constexpr SlaveId kSlaves = 1500;
  for (SlaveId slave = 0; slave < kSlaves; ++slave) store.AddNotEvaluable(kRule, slave, test::Because("why"), 7);
  store.AddNotEvaluable(kOther, 3, test::Because("why"), 8);
  store.FoldNotEvaluable(2000);
  ASSERT_EQ(store.not_evaluable().size(), 2U);
  EXPECT_EQ(store.not_evaluable()[0].slave, kNoSlave);
  EXPECT_EQ(store.not_evaluable()[0].reason, test::Because("why"));
  EXPECT_EQ(store.not_evaluable()[0].slaves, kSlaves);
  EXPECT_EQ(store.not_evaluable()[1].slave, 3);
  EXPECT_EQ(store.lines_left_out(), kSlaves);
}

TEST_F(FindingStoreTest, ReasonsWithoutEndBecomeOne) {
  for (std::size_t i = 0; i < 3 * FindingStore::kMaxReasons; ++i) {
    store.AddNotEvaluable(kRule, 1, test::Because("reason " + std::to_string(i)), i + 1);
  }
  EXPECT_EQ(store.not_evaluable().size(), FindingStore::kMaxReasons + 1);
  EXPECT_EQ(store.not_evaluable().back().occasions, 2 * FindingStore::kMaxReasons);
}

TEST_F(FindingStoreTest, WhatIsNotListedHasALineForItsRule) {
  const RuleInfo third{
      .id = "third", .group = "g", .severity = Severity::kInfo, .title = "t", .needs = "n", .source = "s", .doc = ""};
  const std::array<const RuleInfo*, 3> rules{&kRule, &kOther, &third};
  std::array<RuleInfo, 8> more{third, third, third, third, third, third, third, third};
  const std::array<std::string, 8> names{"r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8"};
  for (std::size_t r = 0; r < more.size(); ++r) more[r].id = names[r];
  for (std::size_t i = 0; i < FindingStore::kMaxReasons; ++i) {
    for (const RuleInfo* rule : rules)
      store.AddNotEvaluable(*rule, 1, test::Because("reason " + std::to_string(i)), i + 1);
    for (const RuleInfo& rule : more)
      store.AddNotEvaluable(rule, 1, test::Because("reason " + std::to_string(i)), i + 1);
  }
  store.FoldNotEvaluable(3);
  EXPECT_EQ(store.not_evaluable().size(), FindingStore::kMaxListed + 11U);
  EXPECT_EQ(store.lines_left_out(), 11 * FindingStore::kMaxReasons - FindingStore::kMaxListed);
}

TEST_F(FindingStoreTest, TheOnlySlaveKeepsItsName) {
  store.AddNotEvaluable(kRule, 0, test::Because("all"), 5);
  store.FoldNotEvaluable(1);
  EXPECT_EQ(store.not_evaluable()[0].slave, 0);
}

TEST_F(FindingStoreTest, RelatedFramesOnceAndNotTooMany) {
  Finding finding;
  AddRelated(finding, 0);
  AddRelated(finding, 4);
  AddRelated(finding, 4);
  EXPECT_EQ(finding.related_frames, std::vector<FrameNo>{4});
  for (FrameNo frame = 10; frame < 100; ++frame) AddRelated(finding, frame);
  EXPECT_EQ(finding.related_frames.size(), FindingStore::kMaxRelatedFrames);
}

}  // namespace
}  // namespace ecaudit
