// How far slaves and axes got, in traces of the rules: which rungs are reached, lost, not reached or not asked for, and
// which finding holds them.
#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/result/absence.h"
#include "analyzers/result/progress.h"
#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"
#include "tests/support/memory_source.h"
#include "tests/support/trace_builder.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

AnalysisResult AnalyseTrace(const std::string& folder, const std::string& trace_of, AnalysisOptions options) {
  const fs::path path = fs::path(test::SourceDir()) / "tests" / folder / (trace_of + ".trace");
  const auto trace = test::Trace::Load(path.string());
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return {};
  }
  options.default_profile = "generic";
  return Analyse(*trace->Source(), options);
}

AnalysisResult AnalyseRule(const std::string& trace_of, AnalysisOptions options = {}) {
  return AnalyseTrace("rules", trace_of, std::move(options));
}

AnalysisResult AnalyseReport(const std::string& trace_of) {
  return AnalyseTrace("reports", trace_of, {});
}

AnalysisResult AnalyseSample(const std::string& name) {
  const fs::path path = fs::path(test::SourceDir()) / "samples" / "captures" / (name + ".pcapng");
  auto source = capture::OpenCapture(path.string());
  if (!source) {
    ADD_FAILURE() << source.error().message;
    return {};
  }
  return ecaudit::Analyse(**source, AnalysisOptions{});
}

const Ladder& AxisOf(const AnalysisResult& result) {
  static const Ladder kNone;
  if (result.slaves.size() == 1 && result.slaves[0].axes.size() == 1) return result.slaves[0].axes[0].ladder;
  ADD_FAILURE() << "not one slave with one axis";
  return kNone;
}

std::string StatusOf(const Ladder& ladder, std::string_view rung) {
  const Rung* const found = ladder.Find(rung);
  return found == nullptr ? "no such rung" : std::string(Name(found->status));
}

std::string WhyOf(const Ladder& ladder, std::string_view rung) {
  const Rung* const found = ladder.Find(rung);
  return found == nullptr || found->why == nullptr ? "" : std::string(found->why->code);
}

std::string RuleOf(const AnalysisResult& result, const Ladder& ladder, std::string_view rung) {
  const Rung* const found = ladder.Find(rung);
  if (found == nullptr || found->held_by == kNoFinding) return "";
  return std::string(result.findings.at(found->held_by).rule);
}

TEST(ProgressLadder, HealthyAxisIsEnabledAndIdle) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/complies");
  const Ladder& axis = AxisOf(result);
  EXPECT_EQ(StatusOf(axis, "no-fault"), "reached");
  EXPECT_EQ(StatusOf(axis, "voltage"), "reached");
  EXPECT_EQ(StatusOf(axis, "enabled"), "reached");
  EXPECT_EQ(StatusOf(axis, "mode"), "reached");
  EXPECT_EQ(StatusOf(axis, "commanded"), "not-asked");
  EXPECT_EQ(StatusOf(axis, "follows"), "not-asked");
  EXPECT_EQ(axis.Failed(), nullptr);
  ASSERT_NE(axis.Highest(), nullptr);
  EXPECT_EQ(axis.Highest()->rung->code, "mode");

  const Ladder& slave = result.slaves.at(0).progress;
  for (const char* const rung : {"answers", "preop", "mailbox", "configured", "safeop", "exchange", "op"}) {
    EXPECT_EQ(StatusOf(slave, rung), "reached") << rung;
  }
  EXPECT_EQ(StatusOf(slave, "sync"), "not-asked");
  EXPECT_EQ(slave.Failed(), nullptr);
}

/// A set point that goes on commands the axis in whatever mode; whether it should follow depends on the mode.
TEST(ProgressLadder, AxisWithoutModeIsCommandedByASetpointThatGoesOn) {
  const AnalysisResult result = AnalyseRule("drive-not-following/unknown-2");
  EXPECT_EQ(StatusOf(AxisOf(result), "mode"), "not-asked");
  EXPECT_EQ(StatusOf(AxisOf(result), "commanded"), "reached");
  EXPECT_EQ(AxisOf(result).Find("commanded")->since.number, 112U);
  EXPECT_EQ(StatusOf(AxisOf(result), "follows"), "unknown");
  EXPECT_EQ(WhyOf(AxisOf(result), "follows"), "mode-not-known");
}

TEST(ProgressLadder, MissingBitHoldsTheAxis) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/violates");
  const Ladder& axis = AxisOf(result);
  EXPECT_EQ(StatusOf(axis, "enabled"), "not-reached");
  EXPECT_EQ(WhyOf(axis, "enabled"), "control-bit-missing");
  EXPECT_EQ(RuleOf(result, axis, "enabled"), "drive-not-enabled");
  ASSERT_NE(axis.Failed(), nullptr);
  EXPECT_EQ(axis.Failed()->rung->code, "enabled");
}

TEST(ProgressLadder, AxisThatNobodyEnablesIsNotAskedFor) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/complies-3");
  EXPECT_EQ(StatusOf(AxisOf(result), "enabled"), "not-asked");
  EXPECT_EQ(AxisOf(result).Failed(), nullptr);
}

/// Without it, that the master asks for nothing is not known.
TEST(ProgressLadder, AxisWithoutControlWordIsUnknown) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/unknown-3");
  EXPECT_EQ(StatusOf(AxisOf(result), "voltage"), "unknown");
  EXPECT_EQ(StatusOf(AxisOf(result), "enabled"), "unknown");
  EXPECT_EQ(WhyOf(AxisOf(result), "enabled"), "no-control-word");
}

TEST(ProgressLadder, FaultIsNeverWithoutFault) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/violates-2");
  EXPECT_EQ(StatusOf(AxisOf(result), "no-fault"), "not-reached");
  EXPECT_EQ(RuleOf(result, AxisOf(result), "no-fault"), "drive-not-enabled");  // the reset has no edge
  EXPECT_EQ(WhyOf(AxisOf(result), "enabled"), "reset-without-edge");
}

TEST(ProgressLadder, FaultInOperationLosesTheRungs) {
  const AnalysisResult result = AnalyseRule("drive-setpoint-jump/violates-2");
  const Ladder& axis = AxisOf(result);
  EXPECT_EQ(StatusOf(axis, "no-fault"), "lost");
  EXPECT_EQ(StatusOf(axis, "enabled"), "lost");
  EXPECT_EQ(RuleOf(result, axis, "no-fault"), "drive-setpoint-jump");  // the cause of the fault
  EXPECT_EQ(WhyOf(axis, "enabled"), "went-into-fault");
}

TEST(ProgressLadder, DriveThatLeavesOperationByItselfIsInNoFault) {
  const AnalysisResult result = AnalyseRule("drive-illegal-state-change/violates-4");
  for (const SlaveSummary& slave : result.slaves) {
    for (const auto& axis : slave.axes) EXPECT_NE(WhyOf(axis.ladder, "enabled"), "went-into-fault");
  }
}

/// Packets from the middle of the process data on, with a clock that was set by that time.
AnalysisResult AnalyseWithClockSet(const std::string& trace_of, TimeNs by) {
  const fs::path path = fs::path(test::SourceDir()) / "tests" / "rules" / (trace_of + ".trace");
  const auto trace = test::Trace::Load(path.string());
  if (!trace) return {};
  std::vector<test::Packet> packets = trace->Packets();
  for (std::size_t i = packets.size() / 2; i < packets.size(); ++i) packets[i].time += by;
  test::MemorySource source(std::move(packets));
  AnalysisOptions options;
  options.default_profile = "generic";
  return Analyse(source, options);
}

TEST(ProgressLadder, AClockThatIsSetHidesNothing) {
  constexpr TimeNs kHour = 3'600'000'000'000;
  for (const TimeNs by : {TimeNs{-2'000'000'000}, 2 * kHour}) {
    const AnalysisResult plain = AnalyseRule("drive-not-following/violates-10");
    const AnalysisResult set = AnalyseWithClockSet("drive-not-following/violates-10", by);
    const Rung* const rung = AxisOf(set).Find("follows");
    ASSERT_NE(rung, nullptr);
    EXPECT_EQ(RuleOf(set, AxisOf(set), "follows"), "drive-not-following") << by;
    EXPECT_EQ(rung->held_since, AxisOf(plain).Find("follows")->held_since) << by;
    const AnalysisResult healthy = AnalyseWithClockSet("drive-not-following/complies", by);
    EXPECT_EQ(AxisOf(healthy).Failed(), nullptr) << by;
  }
}

/// Where the start time had passed, no pulse came that frames could come after.
TEST(ProgressLadder, NoPhaseWithoutPulse) {
  const AnalysisResult result = AnalyseReport("bus/soem476-start-in-past");
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].dc);
  EXPECT_FALSE(result.slaves[0].dc->phase);
  EXPECT_EQ(RuleOf(result, result.slaves[0].progress, "sync"), "sync-start-in-past");
  const AnalysisResult mended = AnalyseReport("bus/soem476-start-in-past-mended");
  EXPECT_TRUE(mended.slaves.at(0).dc->phase);
}

// What stands at the end decides.
TEST(ProgressLadder, FaultThatWasResetHoldsNothing) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/violates-19");
  const Ladder& axis = AxisOf(result);
  EXPECT_EQ(StatusOf(axis, "no-fault"), "reached");
  EXPECT_EQ(RuleOf(result, axis, "no-fault"), "");
  EXPECT_EQ(StatusOf(axis, "enabled"), "reached");
  EXPECT_EQ(axis.Failed(), nullptr);
  for (const Finding& finding : result.findings) EXPECT_EQ(finding.holds, "") << finding.rule;
}

TEST(ProgressLadder, FaultBeforeInitIsNotKnownToStand) {
  const AnalysisResult result = AnalyseRule("drive-fault/violates-14");
  EXPECT_EQ(StatusOf(AxisOf(result), "no-fault"), "unknown");
  EXPECT_EQ(WhyOf(AxisOf(result), "no-fault"), "no-status-word");
}

TEST(ProgressLadder, AxisThatFollowsAgainFollows) {
  for (const char* const name : {"violates-12", "violates-13", "violates-14"}) {
    const AnalysisResult result = AnalyseRule(std::string("drive-not-following/") + name);
    EXPECT_EQ(StatusOf(AxisOf(result), "follows"), "reached") << name;
    ASSERT_FALSE(result.findings.empty()) << name;
    for (const Finding& finding : result.findings) EXPECT_EQ(finding.holds, "") << name << " " << finding.rule;
  }
}

TEST(ProgressLadder, HaltThatWasClearedHoldsNothing) {
  const AnalysisResult result = AnalyseRule("drive-not-commanded/complies-13");
  EXPECT_EQ(StatusOf(AxisOf(result), "commanded"), "reached");
  EXPECT_EQ(StatusOf(AxisOf(result), "follows"), "reached");
}

TEST(ProgressLadder, VoltageThatCameLateHoldsNoStopAfterIt) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/violates-17");
  const Ladder& axis = AxisOf(result);
  EXPECT_EQ(StatusOf(axis, "voltage"), "reached");
  ASSERT_NE(axis.Find("voltage"), nullptr);
  EXPECT_TRUE(axis.Find("voltage")->until.seen());
  EXPECT_EQ(StatusOf(axis, "enabled"), "reached");
  EXPECT_EQ(axis.Failed(), nullptr);
}

TEST(ProgressLadder, FaultOfOneAxisHoldsNoOther) {
  const AnalysisResult result = AnalyseRule("drive-fault/violates-13");
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_EQ(result.slaves[0].axes.size(), 2U);
  EXPECT_EQ(result.slaves[0].axes[0].ladder.Failed(), nullptr);
  const Ladder& faulty = result.slaves[0].axes[1].ladder;
  EXPECT_EQ(StatusOf(faulty, "no-fault"), "lost");
  EXPECT_EQ(RuleOf(result, faulty, "no-fault"), "drive-fault");
}

TEST(ProgressLadder, StopsOfTheMasterFailNothing) {
  for (const char* const name : {"complies-10", "complies-11", "complies-12", "complies-13"}) {
    const AnalysisResult result = AnalyseRule(std::string("drive-not-enabled/") + name);
    const Ladder& axis = AxisOf(result);
    EXPECT_EQ(StatusOf(axis, "enabled"), "reached") << name;
    ASSERT_NE(axis.Find("enabled"), nullptr) << name;
    EXPECT_TRUE(axis.Find("enabled")->until.seen()) << name;
    EXPECT_EQ(axis.Failed(), nullptr) << name;
    EXPECT_EQ(result.slaves.at(0).progress.Failed(), nullptr) << name;
  }
}

TEST(ProgressLadder, ModeThatTheCaptureCutsOffIsUnknown) {
  const AnalysisResult result = AnalyseRule("drive-mode-not-shown/complies-2");
  EXPECT_EQ(StatusOf(AxisOf(result), "mode"), "unknown");
  EXPECT_EQ(WhyOf(AxisOf(result), "mode"), "capture-ends");
}

TEST(ProgressLadder, DatagramsOfOneFrameAreOneStepOfTheAxis) {
  for (const char* const name : {"complies-15", "complies-16"}) {
    const AnalysisResult result = AnalyseRule(std::string("drive-not-following/") + name);
    EXPECT_EQ(StatusOf(AxisOf(result), "enabled"), "reached") << name;
    EXPECT_EQ(StatusOf(AxisOf(result), "follows"), "reached") << name;
  }
}

TEST(ProgressLadder, InferredFindingDecidesNothing) {
  const AnalysisResult result = AnalyseRule("drive-setpoint-jump/violates-3");
  ASSERT_EQ(result.findings.size(), 1U);
  EXPECT_EQ(result.findings[0].confidence, Confidence::kInferred);
  EXPECT_EQ(result.findings[0].holds, "");
}

TEST(ProgressLadder, StartBitHoldsTheMotion) {
  const AnalysisResult result = AnalyseRule("drive-not-commanded/violates");
  const Ladder& axis = AxisOf(result);
  EXPECT_EQ(StatusOf(axis, "enabled"), "reached");
  EXPECT_EQ(StatusOf(axis, "commanded"), "not-reached");
  EXPECT_EQ(WhyOf(axis, "commanded"), "start-bit-missing");
  EXPECT_EQ(StatusOf(axis, "follows"), "not-asked");
}

TEST(ProgressLadder, MotionIsFollowedOrNot) {
  const AnalysisResult follows = AnalyseRule("drive-not-following/complies");
  EXPECT_EQ(StatusOf(AxisOf(follows), "commanded"), "reached");
  EXPECT_EQ(StatusOf(AxisOf(follows), "follows"), "reached");
  const AnalysisResult stands = AnalyseRule("drive-not-following/violates");
  EXPECT_EQ(StatusOf(AxisOf(stands), "commanded"), "reached");
  EXPECT_EQ(StatusOf(AxisOf(stands), "follows"), "not-reached");
  EXPECT_EQ(WhyOf(AxisOf(stands), "follows"), "stands-still");
}

TEST(ProgressLadder, UnknownRungsSayWhy) {
  const AnalysisResult no_status = AnalyseRule("drive-not-enabled/unknown");
  EXPECT_EQ(StatusOf(AxisOf(no_status), "enabled"), "unknown");
  EXPECT_EQ(WhyOf(AxisOf(no_status), "enabled"), "no-status-word");
  const AnalysisResult setpoint = AnalyseRule("drive-not-commanded/unknown");
  EXPECT_EQ(StatusOf(AxisOf(setpoint), "commanded"), "unknown");
  EXPECT_EQ(WhyOf(AxisOf(setpoint), "commanded"), "setpoint-not-in-capture");
}

TEST(ProgressLadder, SlaveThatNeverCountsExchangesNothing) {
  const AnalysisResult result = AnalyseRule("wkc-never-right/violates");
  const Ladder& slave = result.slaves.at(0).progress;
  EXPECT_EQ(StatusOf(slave, "safeop"), "reached");
  EXPECT_EQ(StatusOf(slave, "exchange"), "not-reached");
  EXPECT_EQ(RuleOf(result, slave, "exchange"), "wkc-never-right");
  EXPECT_EQ(StatusOf(slave, "op"), "not-reached");
}

TEST(ProgressLadder, SlaveThatLeftLosesWhatItHad) {
  const AnalysisResult result = AnalyseSample("slave-count-changes");
  EXPECT_EQ(StatusOf(result.slaves.at(0).progress, "op"), "reached");
  for (const std::size_t gone : {1U, 2U}) {
    const Ladder& slave = result.slaves.at(gone).progress;
    EXPECT_EQ(StatusOf(slave, "answers"), "lost");
    EXPECT_EQ(RuleOf(result, slave, "answers"), "bus-slave-count-changed");
    EXPECT_EQ(StatusOf(slave, "op"), "lost");
    EXPECT_EQ(StatusOf(slave, "known"), "reached");
  }
}

TEST(ProgressLadder, SlaveThatReturnedIsThere) {
  const AnalysisResult result = AnalyseSample("wkc-link-break");
  EXPECT_EQ(StatusOf(result.slaves.at(2).progress, "answers"), "reached");
  const std::vector<Absence> absences = AbsencesOf(result.slaves.at(2), result);
  ASSERT_FALSE(absences.empty());
  EXPECT_TRUE(absences.front().to.seen());
  EXPECT_TRUE(AbsencesOf(result.slaves.at(0), result).empty());
  EXPECT_TRUE(OthersAreMissing(result.slaves.at(0), absences.front().from, absences.front().from, result));
}

TEST(ProgressLadder, OfABranchTheSlaveThatStillAnswersStays) {
  const AnalysisResult result = AnalyseSample("branch-slave-leaves");
  EXPECT_EQ(StatusOf(result.slaves.at(1).progress, "answers"), "lost");
  EXPECT_EQ(StatusOf(result.slaves.at(2).progress, "answers"), "reached");
}

TEST(ProgressLadder, FindingThatHoldsSaysSo) {
  const AnalysisResult result = AnalyseRule("drive-not-enabled/violates");
  const auto found = std::find_if(result.findings.begin(), result.findings.end(),
                                  [](const Finding& finding) { return finding.rule == "drive-not-enabled"; });
  ASSERT_NE(found, result.findings.end());
  EXPECT_EQ(found->holds, "enabled");
  for (const Finding& finding : AnalyseRule("drive-not-enabled/complies").findings) EXPECT_EQ(finding.holds, "");
}

TEST(ProgressLadder, OnlyALowerSeverityDecidesAlone) {
  const auto holds = [](Severity chosen) {
    AnalysisOptions options;
    options.rules["drive-not-enabled"].severity = chosen;
    const AnalysisResult result = AnalyseRule("drive-not-enabled/violates", options);
    const auto found = std::find_if(result.findings.begin(), result.findings.end(),
                                    [](const Finding& finding) { return finding.rule == "drive-not-enabled"; });
    return found != result.findings.end() ? std::string(found->holds) : "not found";
  };
  EXPECT_EQ(holds(Severity::kWarning), "enabled") << "that is the rule's own";
  EXPECT_EQ(holds(Severity::kError), "enabled");
  EXPECT_EQ(holds(Severity::kInfo), "");
}

TEST(ProgressLadder, RefusedStateIsHeldByItsRefusal) {
  const AnalysisResult result = AnalyseRule("al-refused/violates");
  const Ladder& slave = result.slaves.at(0).progress;
  const Rung* const failed = slave.Failed();
  ASSERT_NE(failed, nullptr);
  EXPECT_NE(failed->held_by, kNoFinding);
}

}  // namespace
}  // namespace ecaudit
