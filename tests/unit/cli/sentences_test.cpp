#include "cli/report/sentences.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/judge/catalogue.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

constexpr FindingKind kWithNext{.name = "k", .title = "t", .message = "m.", .next = "Change it."};
constexpr FindingKind kNextStays{.name = "k", .title = "t", .message = "m.", .next = "Reset it.", .next_stays = true};
constexpr FindingKind kWithoutNext{.name = "k", .title = "t", .message = "m.", .next = "[{!done}Do it.]"};

/// A root, and what it causes.
AnalysisResult RootAndConsequence(const FindingKind& kind) {
  AnalysisResult result;
  result.findings = {test::MakeFinding("root", Severity::kError, kNoSlave, 5),
                     test::MakeFinding("other", Severity::kError, kNoSlave, 6, 0)};
  for (Finding& finding : result.findings) finding.kind = &kind;
  return result;
}

std::string NextOf(const AnalysisResult& result, std::size_t index) {
  return SentencesOf(result.findings[index], result).next;
}

TEST(Sentences, AConsequenceLeadsToItsCause) {
  AnalysisResult result = RootAndConsequence(kWithNext);
  EXPECT_EQ(NextOf(result, 0), "Change it.");
  EXPECT_EQ(NextOf(result, 1), "Correct f1 (root) first.");
  EXPECT_EQ(MessageOf(result.findings[1], result), "m. Correct f1 (root) first.");
  // By the id that it has in all reports of the capture.
  result.findings[0].number = 12;
  EXPECT_EQ(NextOf(result, 1), "Correct f12 (root) first.");
}

TEST(Sentences, WhatTheCauseDoesNotSettleStays) {
  const AnalysisResult result = RootAndConsequence(kNextStays);
  EXPECT_EQ(NextOf(result, 0), "Reset it.");
  EXPECT_EQ(NextOf(result, 1), "Correct f1 (root) first. Reset it.");
}

TEST(Sentences, WhereNothingIsToBeDoneNothingIsSaid) {
  AnalysisResult result = RootAndConsequence(kWithoutNext);
  EXPECT_EQ(NextOf(result, 1), "Correct f1 (root) first.");
  result.findings[1].arguments.Set("done", arg::Flag(true));
  EXPECT_EQ(NextOf(result, 1), "");
}

TEST(Sentences, NoRuleWritesTheSentenceItself) {
  for (const RuleInfo* rule : RuleCatalogue()) {
    for (const FindingKind* kind : rule->kinds) {
      EXPECT_EQ(kind->next.find("?caused"), std::string_view::npos) << rule->id << " " << kind->name;
      EXPECT_EQ(kind->next.find("orrect the cause."), std::string_view::npos) << rule->id << " " << kind->name;
    }
  }
}

}  // namespace
}  // namespace ecaudit::report
