// What is told of a start-up, from traces that do what masters do (esc-reference 13).
#include "analyzers/collect/startup_recorder.h"

#include <string>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/result/further_startups.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::startup {
namespace {

AnalysisResult ResultOf(const std::string& lines) {
  const auto trace = test::Trace::Parse("@slaves 1\n" + lines);
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return {};
  }
  return Analyse(*trace->Source(), AnalysisOptions{});
}

StartupSummary StartupOf(const std::string& lines) {
  const AnalysisResult result = ResultOf(lines);
  return result.slaves.empty() ? StartupSummary{} : result.slaves[0].startup;
}

/// "mailbox-setup: SM0", ... in order.
std::vector<std::string> Steps(const StartupSummary& startup) {
  std::vector<std::string> steps;
  for (const StartupStep& step : startup.steps) steps.push_back(std::string(Name(step.phase)) + ": " + step.name);
  return steps;
}

std::string State(int state) {
  const std::string digit = std::to_string(state);
  return "+1ms FPWR 0x1001:0x0120 0" + digit + " 00\n+1ms FPRD 0x1001:0x0130 0" + digit + " 00\n";
}

const std::string kAddress =
    "+0us APWR 0:0x0010 01 10\n"
    "+1ms FPRD 0x1001:0x0130 01 00\n";
const std::string kMailbox = "+1ms FPWR 0x1001:0x0800 00 10 80 00 26 00 01 00 80 10 80 00 22 00 01 00\n";
const std::string kOutputs = "+1ms FPWR 0x1001:0x0810 00 11 06 00 64 00 01 00\n";

using Names = std::vector<std::string>;

TEST(StartupRecorder, CutsOneWriteIntoTheSyncManagersItCovers) {
  const StartupSummary startup = StartupOf(kAddress + kMailbox + State(2) + kOutputs + State(4) + State(8));
  EXPECT_EQ(Steps(startup), (Names{"addressing: Configured Station Address", "mailbox-setup: SM0", "mailbox-setup: SM1",
                                   "init-to-preop: PREOP requested", "preop-to-safeop: SM2",
                                   "preop-to-safeop: SAFEOP requested", "safeop-to-op: OP requested"}));
  EXPECT_EQ(startup.reached, 8);
  EXPECT_TRUE(startup.ended);
  const StartupPhaseSummary* preop = startup.phase(StartupPhase::kInitToPreop);
  ASSERT_NE(preop, nullptr);
  EXPECT_EQ(preop->result, "PREOP reached");
  EXPECT_EQ(preop->duration, 1'030'000);  // request sent to status returned
}

TEST(StartupRecorder, TellsASyncManagerByItsModeNotByItsNumber) {
  // A terminal without mailbox: SM0 is process data.
  const StartupSummary startup =
      StartupOf(kAddress + State(2) + "+1ms FPWR 0x1001:0x0800 00 0F 01 00 44 00 01 00\n" + State(4));
  ASSERT_GE(startup.steps.size(), 3U);
  EXPECT_EQ(startup.steps[2].phase, StartupPhase::kPreopToSafeop);
}

TEST(StartupRecorder, ClearingIsPartOfTheScan) {
  const StartupSummary startup =
      StartupOf(kAddress + "+1ms FPWR 0x1001:0x0600 len=64\n+1ms FPWR 0x1001:0x0800 len=32\n" + kMailbox + State(2));
  const Names steps = Steps(startup);
  ASSERT_EQ(steps.size(), 6U);
  EXPECT_EQ(steps[1], "scan: FMMU0-FMMU3");
  EXPECT_EQ(steps[2], "scan: SM0-SM3");
}

TEST(StartupRecorder, OfSeveralAttemptsTellsTheOneThatCameFurthest) {
  // IgH: to PREOP when it finds the slave, back to INIT and up to OP when the application starts.
  const std::string up = kMailbox + State(2);
  const StartupSummary startup = StartupOf(kAddress + up + State(1) + up + kOutputs + State(4) + State(8));
  EXPECT_EQ(startup.reached, 8);
  EXPECT_EQ(startup.again, 1U);
  EXPECT_EQ(Steps(startup),
            (Names{"addressing: Configured Station Address", "scan: INIT requested", "mailbox-setup: SM0",
                   "mailbox-setup: SM1", "init-to-preop: PREOP requested", "preop-to-safeop: SM2",
                   "preop-to-safeop: SAFEOP requested", "safeop-to-op: OP requested"}));
  // Of equal ones the first.
  const StartupSummary equal = StartupOf(kAddress + up + State(1) + up);
  EXPECT_EQ(equal.steps.back().frame.number, StartupOf(kAddress + up).steps.back().frame.number);
}

TEST(StartupRecorder, AnotherStartUpBehindOperationBeginsInInit) {
  const std::string up = kMailbox + State(2) + kOutputs + State(4) + State(8);
  const AnalysisResult once = ResultOf(kAddress + up + State(4) + State(1));
  EXPECT_EQ(NextStartup(once), 0U) << "it is only taken down";
  const AnalysisResult twice = ResultOf(kAddress + up + State(4) + State(1) + up);
  EXPECT_EQ(twice.slaves[0].startup.again, 1U);
  EXPECT_EQ(NextStartup(twice), once.capture.last.number - 3) << "the request of INIT";
  // An attempt before the one that is kept is none behind it.
  EXPECT_EQ(NextStartup(ResultOf(kAddress + kMailbox + State(2) + State(1) + up)), 0U);
}

TEST(StartupRecorder, ARequestThatIsWrittenAgainIsOneStep) {
  const StartupSummary startup = StartupOf(kAddress + "+1ms FPWR 0x1001:0x0120 02 00\n" + State(2));
  ASSERT_EQ(startup.steps.size(), 2U);
  EXPECT_EQ(startup.steps[1].count, 2U);
  EXPECT_EQ(startup.steps[1].outcome, StartupOutcome::kDone);
}

TEST(StartupRecorder, ARequestThatWasLostAndIsWrittenAgainIsOneStep) {
  // That the frame was lost shows when the slave is in PREOP already: masters have several frames under way.
  const StartupSummary startup = StartupOf(kAddress + kMailbox + "+1ms FPWR 0x1001:0x0120 02 00 @lost\n" + State(2) +
                                           kOutputs + State(4) + "+1ms FPRD 0x1001:0x0130 04 00 times=20\n" + State(8));
  EXPECT_EQ(Steps(startup), (Names{"addressing: Configured Station Address", "mailbox-setup: SM0", "mailbox-setup: SM1",
                                   "init-to-preop: PREOP requested", "preop-to-safeop: SM2",
                                   "preop-to-safeop: SAFEOP requested", "safeop-to-op: OP requested"}));
  EXPECT_EQ(startup.steps[3].count, 2U);
  EXPECT_EQ(startup.steps[3].outcome, StartupOutcome::kDone);
  const StartupPhaseSummary* preop = startup.phase(StartupPhase::kInitToPreop);
  ASSERT_NE(preop, nullptr);
  EXPECT_EQ(preop->duration, 2'030'000);  // the lost request sent to status returned
  const StartupPhaseSummary* safeop = startup.phase(StartupPhase::kPreopToSafeop);
  ASSERT_NE(safeop, nullptr);
  EXPECT_EQ(safeop->duration, 2'030'000);  // SM2, request, status
}

TEST(StartupRecorder, ARefusalIsMarkedWithItsCode) {
  const StartupSummary startup = StartupOf(kAddress + State(2) + "+1ms FPWR 0x1001:0x0120 04 00\n" +
                                           "+1ms FPRD 0x1001:0x0130 12 00 00 00 1D 00\n");
  EXPECT_EQ(startup.steps.back().outcome, StartupOutcome::kRefused);
  EXPECT_EQ(startup.steps.back().code, 0x1DU);
  const StartupPhaseSummary* phase = startup.phase(StartupPhase::kPreopToSafeop);
  ASSERT_NE(phase, nullptr);
  EXPECT_TRUE(phase->failed);
  EXPECT_FALSE(startup.ended);
}

std::string Polls(int state, int times) {
  return "+1ms FPRD 0x1001:0x0130 0" + std::to_string(state) + " 00 times=" + std::to_string(times) + "\n";
}

TEST(StartupRecorder, ARequestThatTheMasterGivesUpIsNotFollowed) {
  const std::string waits = kAddress + State(2) + "+1ms FPWR 0x1001:0x0120 04 00\n" + Polls(2, 1) +
                            "+100ms FPRD 0x1001:0x0130 02 00\n+100ms FPRD 0x1001:0x0130 02 00\n" +
                            "+100ms FPRD 0x1001:0x0130 02 00\n";
  // The capture ends while it looks.
  EXPECT_EQ(StartupOf(waits).steps.back().outcome, StartupOutcome::kUnknown);
  EXPECT_EQ(StartupOf(waits + "+300ms FPRD 0x1001:0x0110 00 00\n").steps.back().outcome, StartupOutcome::kUnknown);
  // It looks no more.
  const StartupSummary left = StartupOf(waits + "+2s FPRD 0x1001:0x0110 00 00\n");
  EXPECT_EQ(left.steps.back().outcome, StartupOutcome::kUnanswered);
  EXPECT_EQ(left.steps.back().note, "not followed");
  // It goes back.
  const StartupSummary back = StartupOf(waits + "+1ms FPWR 0x1001:0x0120 02 00\n");
  ASSERT_GE(back.steps.size(), 3U);
  EXPECT_EQ(back.steps[2].outcome, StartupOutcome::kUnanswered);
  // The state comes late.
  EXPECT_EQ(StartupOf(waits + "+5s FPRD 0x1001:0x0130 04 00\n").steps.back().outcome, StartupOutcome::kDone);
}

TEST(StartupRecorder, APhaseBeginsInItsState) {
  // OP requested in INIT belongs to what leads out of INIT; from SAFEOP to OP is what happens in SAFEOP.
  const StartupSummary startup =
      StartupOf(kAddress + "+1ms FPWR 0x1001:0x0120 08 00\n+1ms FPRD 0x1001:0x0130 11 00 00 00 11 00\n" +
                "+1ms FPWR 0x1001:0x0120 11 00\n+1ms FPRD 0x1001:0x0130 01 00\n" + kMailbox + State(2) + kOutputs +
                State(4) + State(8));
  EXPECT_EQ(Steps(startup),
            (Names{"addressing: Configured Station Address", "init-to-preop: OP requested", "scan: INIT requested",
                   "mailbox-setup: SM0", "mailbox-setup: SM1", "init-to-preop: PREOP requested", "preop-to-safeop: SM2",
                   "preop-to-safeop: SAFEOP requested", "safeop-to-op: OP requested"}));
  const StartupPhaseSummary* preop = startup.phase(StartupPhase::kInitToPreop);
  ASSERT_NE(preop, nullptr);
  EXPECT_EQ(preop->result, "PREOP reached");
  EXPECT_FALSE(preop->failed);
  const StartupPhaseSummary* op = startup.phase(StartupPhase::kSafeopToOp);
  ASSERT_NE(op, nullptr);
  EXPECT_EQ(op->duration, 1'030'000);
}

TEST(StartupRecorder, AWayDownBelongsToTheStateItLeadsTo) {
  const StartupSummary startup =
      StartupOf(kAddress + kMailbox + State(2) + kOutputs + State(4) + State(2) + kOutputs + State(4) + State(8));
  const StartupPhaseSummary* op = startup.phase(StartupPhase::kSafeopToOp);
  ASSERT_NE(op, nullptr);
  EXPECT_EQ(op->duration, 1'030'000);
  EXPECT_EQ(startup.steps.back().phase, StartupPhase::kSafeopToOp);
}

TEST(StartupRecorder, GivingUpIsNoPartOfThePhase) {
  const std::string up = kAddress + kMailbox + State(2) + kOutputs + State(4);
  const StartupSummary startup = StartupOf(up + "+5s FPRD 0x1001:0x0130 04 00\n" + State(2));
  const StartupPhaseSummary* safeop = startup.phase(StartupPhase::kPreopToSafeop);
  ASSERT_NE(safeop, nullptr);
  EXPECT_EQ(safeop->result, "SAFEOP reached");
  EXPECT_EQ(safeop->duration, StartupOf(up).phase(StartupPhase::kPreopToSafeop)->duration);
  EXPECT_EQ(startup.steps.back().name, "PREOP requested");
}

TEST(StartupRecorder, AMasterThatDoesNotLookMakesItsPhasesNevertheless) {
  const StartupSummary startup =
      StartupOf(kAddress + "+1ms FPWR 0x1001:0x0120 02 00\n+1ms FPWR 0x1001:0x0120 04 00\n" + State(8));
  EXPECT_EQ(Steps(startup), (Names{"addressing: Configured Station Address", "init-to-preop: PREOP requested",
                                   "preop-to-safeop: SAFEOP requested", "safeop-to-op: OP requested"}));
}

TEST(StartupRecorder, WhatIsReadBackIsTold) {
  const StartupSummary startup =
      StartupOf(kAddress + State(2) + "+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPRD 0x1001:0x0420 64 00\n");
  EXPECT_EQ(startup.steps.back().read_back, (std::vector<std::uint8_t>{0x64, 0x00}));
  EXPECT_FALSE(startup.steps.back().read_text.empty());
}

TEST(StartupRecorder, CountersMailboxesAndEepromCommandsAreNoSteps) {
  const StartupSummary startup =
      StartupOf(kAddress + "+1ms FPWR 0x1001:0x0300 len=8\n" + "+1ms FPWR 0x1001:0x0502 00 01 08 00 00 00\n" +
                kMailbox + State(2) + "+1ms FPWR 0x1001:0x1000 len=128\n+1ms FPWR 0x1001:0x080E 03\n");
  EXPECT_EQ(startup.steps.size(), 4U);
}

TEST(StartupRecorder, TimesAndAddressesAreVolatile) {
  const StartupSummary startup = StartupOf(
      kAddress + "+1ms FPWR 0x1001:0x0920 len=8\n+1ms FPWR 0x1001:0x09A0 40 42 0F 00\n+1ms FPWR 0x1001:0x0990 len=8\n");
  ASSERT_EQ(startup.steps.size(), 4U);
  EXPECT_TRUE(startup.steps[0].volatile_value);
  EXPECT_TRUE(startup.steps[1].volatile_value);
  EXPECT_FALSE(startup.steps[2].volatile_value);
  EXPECT_TRUE(startup.steps[3].volatile_value);
}

TEST(StartupRecorder, KeepsABoundedNumberOfSteps) {
  std::string lines = kAddress + State(2);
  for (std::size_t i = 0; i < StartupRecorder::kMaxSteps; ++i) {
    lines += i % 2 == 0 ? "+1ms FPWR 0x1001:0x0420 E8 03\n" : "+1ms FPWR 0x1001:0x0400 C2 09\n";
    lines += "+1ms FPWR 0x1001:0x0410 " + std::string(i % 4 < 2 ? "01" : "02") + " 00\n";
  }
  const StartupSummary startup = StartupOf(lines);
  EXPECT_EQ(startup.steps.size(), StartupRecorder::kMaxSteps);
  EXPECT_GT(startup.steps_left_out, 0U);
}

TEST(StartupRecorder, AnOutboundCaptureEndsWithTheRequestOfOp) {
  const StartupSummary startup = StartupOf("@out-only\n" + kAddress + kMailbox + State(2) + kOutputs + State(4) +
                                           State(8) + "+1ms FPWR 0x1001:0x0420 E8 03\n");
  EXPECT_EQ(startup.steps.back().name, "OP requested");
  EXPECT_TRUE(startup.ended);
}

TEST(StartupRecorder, BroadcastsBelongToAllSlaves) {
  const AnalysisResult result =
      ResultOf("+0us BWR 0x0101 00\n+1ms BWR 0x0101 00\n" + kAddress + "+1ms BWR 0x0900 len=4\n");
  ASSERT_EQ(result.bus.startup.steps.size(), 2U);
  EXPECT_EQ(result.bus.startup.steps[0].count, 2U);
  EXPECT_EQ(result.bus.startup.steps[1].phase, StartupPhase::kDc);
  ASSERT_EQ(result.slaves.size(), 1U);
  EXPECT_EQ(result.slaves[0].startup.steps.size(), 1U);
}

TEST(StartupRecorder, BroadcastsOfAnOutboundCaptureAreAssumed) {
  const AnalysisResult result = ResultOf("@out-only\n+0us BWR 0x0101 00\n+1ms BWR 0x0101 00\n" + kAddress);
  ASSERT_EQ(result.bus.startup.steps.size(), 1U);
  EXPECT_EQ(result.bus.startup.steps[0].count, 2U);
  EXPECT_EQ(result.bus.startup.steps[0].outcome, StartupOutcome::kDone);
  EXPECT_EQ(result.bus.startup.steps[0].frame.number, 1U);
}

TEST(StartupRecorder, ACaptureOfOperationHoldsNone) {
  const StartupSummary startup = StartupOf("+0us FPRD 0x1001:0x0130 08 00\n+1ms FPWR 0x1001:0x0420 E8 03\n");
  EXPECT_TRUE(startup.steps.empty());
  EXPECT_FALSE(startup.seen);
  EXPECT_EQ(startup.first_state, 8);
}

}  // namespace
}  // namespace ecaudit::startup
