#include "analyzers/judge/finding_store.h"

#include <gtest/gtest.h>

#include "analyzers/result/every_slave.h"

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
  store.AddNotEvaluable(kRule, 0, "why", 1);
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
}

TEST_F(FindingStoreTest, NotEvaluableOncePerReason) {
  store.AddNotEvaluable(kRule, 0, "why", 7);
  store.AddNotEvaluable(kRule, 0, "why", 9);
  store.AddNotEvaluable(kRule, 0, "another", 9);
  ASSERT_EQ(store.not_evaluable().size(), 2U);
  EXPECT_EQ(store.not_evaluable()[0].first_frame, 7U);
  EXPECT_EQ(store.not_evaluable()[0].occasions, 2U);
}

TEST_F(FindingStoreTest, WhatHoldsForAllSlavesIsOneEntry) {
  for (const SlaveId slave : {SlaveId{0}, SlaveId{1}, SlaveId{2}})
    store.AddNotEvaluable(kRule, slave, "all", 5U + slave);
  store.AddNotEvaluable(kRule, 1, "one", 2);
  store.AddNotEvaluable(kOther, kNoSlave, "all", 0);
  store.FoldNotEvaluable(3);
  ASSERT_EQ(store.not_evaluable().size(), 3U);
  EXPECT_EQ(store.not_evaluable()[0].slave, kEverySlave);
  EXPECT_EQ(store.not_evaluable()[0].reason, "all");
  EXPECT_EQ(store.not_evaluable()[0].first_frame, 5U);
  EXPECT_EQ(store.not_evaluable()[0].occasions, 3U);
  EXPECT_EQ(store.not_evaluable()[1].slave, 1);
  EXPECT_EQ(store.not_evaluable()[2].rule, "al-timeout");
  EXPECT_EQ(store.not_evaluable()[2].slave, kNoSlave) << "the bus itself";
}

TEST_F(FindingStoreTest, BeyondTheLimitOneEntryForEachRuleStandsForTheRest) {
  for (std::size_t i = 0; i < FindingStore::kMaxNotEvaluable; ++i) {
    store.AddNotEvaluable(kRule, static_cast<SlaveId>(i), "why", 7);
  }
  for (const SlaveId slave : {SlaveId{2000}, SlaveId{2001}}) {
    store.AddNotEvaluable(kRule, slave, "why", 9);
    store.AddNotEvaluable(kOther, slave, "why", 9);
  }
  store.AddNotEvaluable(kRule, 5, "why", 9);
  const auto& entries = store.not_evaluable();
  ASSERT_EQ(entries.size(), FindingStore::kMaxNotEvaluable + 2);
  EXPECT_EQ(entries[5].occasions, 2U) << "what is listed goes on counting";
  const NotEvaluable& rest = entries[FindingStore::kMaxNotEvaluable];
  EXPECT_EQ(rest.rule, "al-refused");
  EXPECT_EQ(rest.slave, kNoSlave);
  EXPECT_EQ(rest.occasions, 2U);
  EXPECT_EQ(entries.back().rule, "al-timeout");
}

TEST_F(FindingStoreTest, TheOnlySlaveKeepsItsName) {
  store.AddNotEvaluable(kRule, 0, "all", 5);
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
