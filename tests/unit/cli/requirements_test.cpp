#include "cli/requirements.h"

#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::cli {
namespace {

using test::MakeSlave;

/// Two slaves in OP.
AnalysisResult TwoInOp() {
  AnalysisResult result;
  result.capture.ethercat_frames = 100;
  result.capture.direction = DirectionSeen::kBoth;
  result.slaves = {MakeSlave(4, 0, 0x1001, "A"), MakeSlave(5, 1, 0x1002, "B")};
  for (SlaveSummary& slave : result.slaves) slave.al_status = 0x08;
  result.coverage = {{"a", "c", {{4, Coverage::kJudged, {}}, {5, Coverage::kJudged, {}}}}};
  return result;
}

std::vector<std::string> Missing(std::string_view text, const AnalysisResult& result, bool part = false) {
  const Result<Requirements> required = ParseRequirements(text);
  EXPECT_TRUE(required) << text;
  return required ? MissingOf(*required, result, result.slaves.size(), part) : std::vector<std::string>{"not read"};
}

Rung RungOf(const Word& word, RungStatus status) {
  Rung rung;
  rung.rung = &word;
  rung.status = status;
  return rung;
}

using Texts = std::vector<std::string>;

TEST(Requirements, EachPartIsRead) {
  const auto all = ParseRequirements("slaves=3,state=OP,judged");
  ASSERT_TRUE(all);
  EXPECT_EQ(all->slaves, 3);
  EXPECT_EQ(all->state, esc::AlState::OP);
  EXPECT_TRUE(all->judged);
  EXPECT_TRUE(all->any());
  const auto one = ParseRequirements("judged");
  ASSERT_TRUE(one);
  EXPECT_FALSE(one->slaves || one->state);
  EXPECT_FALSE(Requirements{}.any());
}

TEST(Requirements, WhatIsWrongIsReportedInOneLine) {
  const auto error_of = [](std::string_view text) {
    const auto required = ParseRequirements(text);
    return required ? std::string() : required.error().message;
  };
  const std::string example = "; for example slaves=3,state=OP,judged";
  EXPECT_EQ(error_of("slaves=x"), "--require is 'slaves=x' but slaves must be a number of slaves" + example);
  EXPECT_EQ(error_of("state=RUN"),
            "--require is 'state=RUN' but state must be INIT, PREOP, BOOT, SAFEOP or OP" + example);
  EXPECT_EQ(error_of("judged,judged"), "--require is 'judged,judged' but judged appears twice" + example);
  EXPECT_EQ(error_of("judged,"), "--require is 'judged,' but it ends with a comma" + example);
  for (const char* text : {"", "slaves", "slaves=", "slaves=-1", "slaves=70000", "state=", "judged=yes",
                           "state=OP;judged", "judged=", "judged=0%", "judged=101%", "judged=90", "reached=",
                           "reached=OP,reached=OP", "slaves=1,,judged", "slaves=1,slaves=1", "state=OP,state=OP"}) {
    EXPECT_NE(error_of(text), "") << text;
    EXPECT_EQ(error_of(text).find('\n'), std::string::npos) << text;
  }
  EXPECT_NE(error_of("slave=3").find("slaves"), std::string::npos);
}

TEST(Requirements, NothingIsMissingOfAHealthyBus) {
  EXPECT_EQ(Missing("slaves=2,state=OP,judged", TwoInOp()), Texts{});
  AnalysisResult counted = TwoInOp();
  counted.bus.slave_count = 2;
  EXPECT_EQ(Missing("slaves=2,state=OP,judged", counted), Texts{});
}

TEST(Requirements, OtherStatesAreNamed) {
  AnalysisResult result = TwoInOp();
  result.slaves[1].al_status = 0x14;
  EXPECT_EQ(Missing("state=OP", result), Texts{"state=OP: slave 1 is in SAFEOP+ERR at the end"});
  // In the state, with the error bit: not there.
  EXPECT_EQ(Missing("state=SAFEOP", result).size(), 2U);
  result.slaves[0].al_status = 0x14;
  EXPECT_EQ(Missing("state=OP", result), Texts{"state=OP: slaves 0-1 are in SAFEOP+ERR at the end"});
  result.slaves[0].al_status.reset();
  EXPECT_EQ(Missing("state=OP", result).back(), "state=OP: the AL state of slave 0 is not in the capture");
}

TEST(Requirements, AnEchoedAcknowledgeIsNoError) {
  AnalysisResult result = TwoInOp();
  result.slaves[1].al_status = 0x18;
  EXPECT_EQ(Missing("state=OP", result), Texts{"state=OP: slave 1 is in OP+ERR at the end"});
  result.slaves[1].al_echo = true;
  EXPECT_EQ(Missing("state=OP", result), Texts{});
  // It is in the state it shows, and in no other.
  result.slaves[1].al_status = 0x14;
  EXPECT_EQ(Missing("state=OP", result), Texts{"state=OP: slave 1 is in SAFEOP at the end"});
}

TEST(Requirements, TheLastBroadcastCounts) {
  AnalysisResult result = TwoInOp();
  EXPECT_EQ(Missing("slaves=3", result), Texts{"slaves=3: the capture shows 2 slaves"});
  result.bus.slave_count = 1;
  EXPECT_EQ(Missing("slaves=2", result), Texts{"slaves=2: 1 slave answers broadcasts at the end"});
  // One that nothing else shows.
  result.bus.slave_count = 3;
  EXPECT_EQ(Missing("slaves=3,state=OP", result),
            Texts{"state=OP: the AL state of 1 further slave is not in the capture"});
}

TEST(Requirements, NothingIsKnownOfAnEmptyCapture) {
  const Texts missing = Missing("slaves=1,state=OP,judged", AnalysisResult{});
  ASSERT_EQ(missing.size(), 3U);
  EXPECT_EQ(missing[0], "slaves=1: the capture shows no slave");
  EXPECT_EQ(missing[1], "state=OP: the capture does not show the AL state of any slave");
  EXPECT_EQ(missing[2], "judged: the capture has no EtherCAT frames");
}

TEST(Requirements, AStateThatWasReachedMayBeLeft) {
  AnalysisResult result = TwoInOp();
  result.slaves[1].al_status = 0x01;
  EXPECT_EQ(Missing("reached=OP", result), Texts{"reached=OP: slave 1 never shows OP"});
  result.slaves[1].al_history = {test::MakeStep(AlStep::Kind::kRequest, 5, 0, 0x08)};
  EXPECT_EQ(Missing("reached=OP", result).size(), 1U) << "a request is no state";
  result.slaves[1].al_history.push_back(test::MakeStep(AlStep::Kind::kState, 6, 0x04, 0x18));
  EXPECT_EQ(Missing("reached=OP", result).size(), 1U) << "with the error bit";
  result.slaves[1].al_history_left_out = 1;
  EXPECT_EQ(Missing("reached=OP", result), Texts{"reached=OP: the AL history of slave 1 is too long to be kept"});
  result.slaves[1].al_history.push_back(test::MakeStep(AlStep::Kind::kState, 7, 0x04, 0x08));
  EXPECT_EQ(Missing("reached=OP", result), Texts{});
  EXPECT_EQ(Missing("state=OP", result).size(), 1U);
  result.bus.slave_count = 3;
  EXPECT_EQ(Missing("reached=OP", result), Texts{"reached=OP: the AL states of all slaves are not in the capture"});
}

TEST(Requirements, JudgedMeansMostOfWhatApplies) {
  AnalysisResult result = TwoInOp();
  result.coverage = {{"a", "c", {{4, Coverage::kJudged, {}}, {5, Coverage::kNotJudged, {}}}},
                     {"b", "c", {{4, Coverage::kPartly, {}}, {5, Coverage::kNotApplicable, {}}}}};
  EXPECT_EQ(Missing("judged", result), Texts{"judged=50%: 1 of 3 evaluations was possible (33%)"});
  EXPECT_EQ(Missing("judged=33%", result), Texts{});
  EXPECT_EQ(Missing("judged=34%", result), Texts{"judged=34%: 1 of 3 evaluations was possible (33%)"});
  result.coverage[0].slaves[1].coverage = Coverage::kJudged;
  EXPECT_EQ(Missing("judged", result), Texts{});
  EXPECT_EQ(Missing("judged=90%", result).size(), 1U);
}

TEST(Requirements, NothingEvaluatedIsNotJudged) {
  AnalysisResult result = TwoInOp();
  result.coverage.clear();
  EXPECT_EQ(Missing("judged", result), Texts{"judged: no evaluation applies to the capture"});
  // All that would apply is switched off.
  result.coverage = {
      {"a", "c", {{4, Coverage::kNotApplicable, NotApplicable::kSwitchedOff}, {5, Coverage::kNotApplicable, {}}}}};
  EXPECT_EQ(Missing("judged=1%", result), Texts{"judged=1%: 0 of 1 evaluation was possible (0%; 1 is switched off)"});
}

TEST(Requirements, SlavesThatOnlyBroadcastsShowMayHaveAxesAndSync0) {
  static constexpr Word kEnabled{"enabled", "enabled"};
  static constexpr Word kSync{"sync", "in sync"};
  AnalysisResult result = TwoInOp();
  result.slaves[0].progress.rungs = {RungOf(kSync, RungStatus::kReached)};
  result.slaves[1].progress.rungs = {RungOf(kSync, RungStatus::kNotAsked)};
  result.slaves[0].axes = {{0, {{RungOf(kEnabled, RungStatus::kReached)}}}};
  EXPECT_EQ(Missing("axis=enabled,sync=ok", result), Texts{});
  result.bus.slave_count = 3;
  EXPECT_EQ(Missing("axis=enabled,sync=ok", result),
            (Texts{"axis=enabled: the axes of 1 further slave are not in the capture",
                   "sync=ok: the synchronisation of 1 further slave is not in the capture"}));
  EXPECT_EQ(Missing("axis=enabled,sync=ok", result, true), Texts{}) << "--slave selects others";
}

TEST(Requirements, SelectedSlavesDoNotAnswerForTheRest) {
  AnalysisResult result = TwoInOp();
  result.bus.slave_count = 3;
  result.bus.al = BusAlSummary{};
  result.bus.al->status = 0x0C;
  EXPECT_EQ(Missing("state=OP", result).size(), 2U);
  EXPECT_EQ(Missing("state=OP,reached=OP", result, true), Texts{});
  EXPECT_EQ(Missing("slaves=2", result, true).size(), 1U) << "the bus";
}

TEST(Requirements, TheStatusOfARungComesFirst) {
  static constexpr Word kEnabled{"enabled", "enabled"};
  static constexpr Word kWhy{"in-fault", "the drive is in Fault"};
  AnalysisResult result = TwoInOp();
  Rung rung = RungOf(kEnabled, RungStatus::kNotReached);
  rung.why = &kWhy;
  result.slaves[0].axes = {{0, {{rung}}}};
  EXPECT_EQ(Missing("axis=enabled", result), Texts{"axis=enabled: slave 0: not-reached (the drive is in Fault)"});
}

TEST(Requirements, UnjudgedSlavesAreNamed) {
  AnalysisResult result = TwoInOp();
  result.slaves[1].not_evaluated = test::Because("its AL state");
  EXPECT_EQ(Missing("judged", result), Texts{"judged: slave 1: its AL state is not in the capture"});
}

}  // namespace
}  // namespace ecaudit::cli
