// The AL machine by itself: what it concludes from requests and reads, one step at a time.
#include "analyzers/model/al_machine.h"

#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/wiring/event_bus.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::model {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kMs = 1'000'000;

/// Writes one word a conclusion: "judged:legal", "refused", "by-itself 8>14".
class Log final : public EventBus {
 public:
  Log() {
    ListenTo<AlRequestJudged, AlAnswered, AlErrorRepeated, AlChangedByItself, AlErrorCode, AlErrorCleared, AlOverdue>(
        Stage::kModel, *this);
  }
  void On(const AlRequestJudged& e) {
    static const char* const kVerdicts[] = {"legal", "illegal", "invalid", "needs-acknowledge", "unknown"};
    last_judged = e;
    judged.push_back(kVerdicts[static_cast<std::size_t>(e.request.verdict)]);
  }
  void On(const AlAnswered& e) {
    static const char* const kOutcomes[] = {"reached", "refused", "accepted-illegal"};
    last_answered = e;
    lines.push_back(kOutcomes[static_cast<std::size_t>(e.outcome)]);
  }
  void On(const AlErrorRepeated&) { ++repeated; }
  void On(const AlChangedByItself& e) {
    last_change = e;
    lines.push_back("by-itself " + std::to_string(e.before.raw) + ">" + std::to_string(e.status.raw));
  }
  void On(const AlErrorCode& e) { lines.push_back("code " + std::to_string(e.code)); }
  void On(const AlErrorCleared&) { lines.emplace_back("cleared"); }
  void On(const AlOverdue& e) {
    last_overdue = e;
    lines.emplace_back("overdue");
  }

  std::vector<std::string> judged;
  std::vector<std::string> lines;
  int repeated = 0;
  AlRequestJudged last_judged;
  AlAnswered last_answered;
  AlChangedByItself last_change;
  AlOverdue last_overdue;
};

class AlMachineTest : public ::testing::Test {
 protected:
  AlMachineTest() { machine.SetFamily(*device::BuiltinProfile("generic")); }

  FrameRef Frame() { return {++number, now, timed}; }
  void After(std::int64_t ns) { now += ns; }

  /// A request that the slave takes; 1 ms passes.
  void Request(std::uint16_t control, track::Acceptance acceptance = track::Acceptance::kAccepted) {
    machine.OnRequestSent(Frame(), esc::AlWord{control});
    Returned(control, acceptance);
  }
  /// The returned copy of a request that is under way.
  void Returned(std::uint16_t control, track::Acceptance acceptance) {
    track::AlRequest request;
    request.sent = FrameRef{number, now, timed};
    request.returned = Frame();
    request.control = esc::AlWord{control};
    request.acceptance = acceptance;
    machine.OnRequest(request);
    After(kMs);
  }
  /// A read of AL Status, with the code where one is given; 1 ms passes.
  void Read(std::uint16_t status, std::optional<std::uint16_t> code = std::nullopt) {
    track::AlStatusRead read;
    read.frame = Frame();
    read.status = esc::AlWord{status};
    read.status_code = code;
    machine.OnStatus(read);
    After(kMs);
  }
  /// The same, asked for by a frame that was sent before others.
  void ReadAskedBy(const FrameRef& sent, std::uint16_t status, std::optional<std::uint16_t> code = std::nullopt) {
    track::AlStatusRead read;
    read.sent = sent;
    read.frame = Frame();
    read.status = esc::AlWord{status};
    read.status_code = code;
    machine.OnStatus(read);
    After(kMs);
  }
  /// A broadcast of several slaves, one of which has the error bit set: only the state is known.
  void ReadStateOnly(std::uint16_t state) {
    track::AlStatusRead read;
    read.frame = Frame();
    read.status = esc::AlWord{state};
    read.error_bit_known = false;
    machine.OnStatus(read);
    After(kMs);
  }
  /// The master asks for SAFEOP and looks once; the slave stays in PREOP.
  void Wait() {
    Read(0x02);
    Request(0x04);
    Read(0x02);
  }
  /// The capture misses packets for this time; the slave is forgotten with them.
  void Gap(std::int64_t ns) {
    const FrameRef last = Frame();
    After(ns);
    const FrameRef first = Frame();
    machine.OnGap({first, true, false, false, last});
    machine.Forget(first);
  }
  void ReadCode(std::uint16_t code) { machine.OnStatusCode({0, Frame(), code}); }

  Log log;
  AlMachine machine{0, log};
  FrameNo number = 0;
  TimeNs now = 0;
  bool timed = true;
};

// --- requests
// ---------------------------------------------------------------------------------------------------------

TEST_F(AlMachineTest, NothingKnownNothingJudged) {
  Request(0x08);
  EXPECT_THAT(log.judged, ElementsAre("unknown"));
  EXPECT_TRUE(machine.possible().empty());
}

TEST_F(AlMachineTest, InitMayAlwaysBeRequested) {
  Request(0x01);
  EXPECT_THAT(log.judged, ElementsAre("legal"));
}

TEST_F(AlMachineTest, EachStepOfAStartUpIsLegalAndReached) {
  Read(0x01);
  for (const std::uint16_t state : std::initializer_list<std::uint16_t>{0x02, 0x04, 0x08}) {
    Request(state);
    Read(state);
  }
  EXPECT_THAT(log.judged, ElementsAre("legal", "legal", "legal"));
  EXPECT_THAT(log.lines, ElementsAre("reached", "reached", "reached"));
  EXPECT_TRUE(machine.SettledIn(esc::AlState::OP));
}

TEST_F(AlMachineTest, WhatIsSentBehindAReadDoesNotExplainIt) {
  Read(0x08);
  const FrameRef asked = Frame();
  machine.OnRequestSent(Frame(), esc::AlWord{0x12});
  ReadAskedBy(asked, 0x14, 0x001B);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>20"));
  Returned(0x12, track::Acceptance::kAccepted);
  Read(0x02);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>20", "cleared", "reached"));
}

TEST_F(AlMachineTest, AFallShownByAReadSentBeforeTheRequest) {
  Read(0x08);
  const FrameRef asked = Frame();
  machine.OnRequestSent(Frame(), esc::AlWord{0x02});
  ReadAskedBy(asked, 0x02);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>2"));
}

TEST_F(AlMachineTest, WhatIsSentBeforeAReadMayExplainIt) {
  Read(0x08);
  machine.OnRequestSent(Frame(), esc::AlWord{0x02});
  const FrameRef asked = Frame();
  ReadAskedBy(asked, 0x14, 0x001B);
  EXPECT_TRUE(log.lines.empty());
}

TEST_F(AlMachineTest, AnAcknowledgeSentBehindTheReadOfTheErrorMayHaveBeenTaken) {
  Read(0x08);
  const FrameRef asked = Frame();
  const FrameRef acknowledge = Frame();
  machine.OnRequestSent(acknowledge, esc::AlWord{0x14});
  ReadAskedBy(asked, 0x14, 0x001B);
  Request(0x08);
  EXPECT_THAT(log.judged, ElementsAre("legal"));
}

TEST_F(AlMachineTest, NotSettledWhileARequestIsOpenOrUnderWay) {
  Read(0x08);
  ASSERT_TRUE(machine.SettledIn(esc::AlState::OP));
  machine.OnRequestSent(Frame(), esc::AlWord{0x04});
  Read(0x08);
  EXPECT_FALSE(machine.SettledIn(esc::AlState::OP)) << "may have left OP since the read was sent";
  Returned(0x04, track::Acceptance::kAccepted);
  EXPECT_FALSE(machine.SettledIn(esc::AlState::OP));
  Read(0x04);
  EXPECT_TRUE(machine.SettledIn(esc::AlState::SAFEOP));
}

TEST_F(AlMachineTest, RequestsWithoutReadsAreJudgedFromAllStatesTheyMayHaveLedTo) {
  Read(0x01);
  Request(0x02);
  Request(0x04);
  Request(0x08);
  EXPECT_THAT(log.judged, ElementsAre("legal", "legal", "legal"));
  EXPECT_EQ(log.last_judged.request.from, 0) << "INIT, PREOP or SAFEOP";
  Read(0x08);
  Request(0x03);
  EXPECT_THAT(log.judged.back(), "illegal");
  EXPECT_EQ(log.last_judged.request.from, 8);
}

TEST_F(AlMachineTest, RequestThatIsLegalFromAnyOfThemIsLegal) {
  Read(0x01);
  Request(0x02);
  Request(0x03);
  EXPECT_THAT(log.judged.back(), "legal") << "BOOT from INIT, where the slave may still be";
}

TEST_F(AlMachineTest, RequestThatTheSlaveDidNotTakeChangesNothing) {
  Read(0x01);
  Request(0x08, track::Acceptance::kRefused);
  EXPECT_THAT(log.judged, IsEmpty());
  Read(0x01);
  EXPECT_THAT(log.lines, IsEmpty());
  EXPECT_TRUE(machine.SettledIn(esc::AlState::INIT));
}

TEST_F(AlMachineTest, LostRequestMayHaveBeenTaken) {
  Read(0x01);
  Request(0x02, track::Acceptance::kUnknown);
  EXPECT_THAT(log.judged, IsEmpty());
  Request(0x04);
  EXPECT_THAT(log.judged, ElementsAre("legal")) << "from PREOP, where the lost request may have led";
}

TEST_F(AlMachineTest, LossThatShowsLateWasKnownFromWhenItWasSent) {
  Read(0x01);
  machine.OnRequestSent(Frame(), esc::AlWord{0x02});  // never comes back, but that only shows later
  Request(0x04);
  EXPECT_THAT(log.judged, ElementsAre("legal")) << "frames do not overtake each other: PREOP was lost or taken";
  Read(0x04);
  EXPECT_TRUE(machine.SettledIn(esc::AlState::SAFEOP)) << "and what was asked before is over";
  Request(0x03);
  EXPECT_EQ(log.judged.back(), "illegal");
}

TEST_F(AlMachineTest, LossDeclaredAfterTheSlaveWentOnChangesNothing) {
  Read(0x01);
  const FrameRef lost = Frame();
  machine.OnRequestSent(lost, esc::AlWord{0x02});
  Request(0x02);
  Read(0x02);
  Request(0x04);
  Read(0x04);
  track::AlRequest request;
  request.sent = lost;
  request.control = esc::AlWord{0x02};
  request.acceptance = track::Acceptance::kUnknown;
  machine.OnRequest(request);
  EXPECT_TRUE(machine.SettledIn(esc::AlState::SAFEOP));
  Read(0x02);
  EXPECT_THAT(log.lines, ElementsAre("reached", "reached", "by-itself 4>2"));
}

TEST_F(AlMachineTest, OutboundOnlyTakesTheSlaveToFollow) {
  Request(0x01, track::Acceptance::kAssumed);
  Request(0x02, track::Acceptance::kAssumed);
  EXPECT_TRUE(log.last_judged.request.assumed);
  Request(0x08, track::Acceptance::kAssumed);
  EXPECT_THAT(log.judged, ElementsAre("legal", "legal", "illegal"));
  EXPECT_EQ(log.last_judged.request.from, 2);
}

TEST_F(AlMachineTest, ValuesThatAreNoState) {
  Read(0x02);
  for (const std::uint16_t value : std::initializer_list<std::uint16_t>{0x00, 0x05, 0x06, 0x07, 0x09, 0x0F}) {
    Request(value);
  }
  EXPECT_THAT(log.judged, ElementsAre("invalid", "invalid", "invalid", "invalid", "invalid", "invalid"));
}

// --- answers
// ----------------------------------------------------------------------------------------------------------

TEST_F(AlMachineTest, SlowSlaveIsWaitedFor) {
  Read(0x02);
  Request(0x04);
  for (int i = 0; i < 1000; ++i) Read(0x02);
  Read(0x04);
  EXPECT_THAT(log.lines, ElementsAre("reached"));
}

TEST_F(AlMachineTest, RefusalTellsRequestAndCode) {
  Read(0x02, 0);
  Request(0x04);
  const FrameNo request = log.last_judged.request.frame.number;
  Read(0x02, 0);
  Read(0x12, 0x001D);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
  EXPECT_EQ(log.last_answered.request.frame.number, request);
  EXPECT_EQ(log.last_answered.request.from, 2);
  EXPECT_EQ(log.last_answered.code, 0x001D);
  EXPECT_TRUE(log.last_answered.state_before_known);
  Read(0x12, 0x001D);
  Read(0x12, 0x001D);
  EXPECT_EQ(log.repeated, 2);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
}

TEST_F(AlMachineTest, CodeReadLater) {
  Read(0x02);
  Request(0x04);
  Read(0x12);
  ReadCode(0x0017);
  ReadCode(0x0017);
  EXPECT_THAT(log.lines, ElementsAre("refused", "code 23"));
}

TEST_F(AlMachineTest, CodeAfterTheErrorIsGoneBelongsToNothing) {
  Read(0x02);
  Request(0x04);
  Read(0x12);
  Request(0x12);
  Read(0x02);
  ReadCode(0x0017);
  EXPECT_THAT(log.lines, ElementsAre("refused", "cleared", "reached"));
}

TEST_F(AlMachineTest, RefusalInAnotherStateThanBefore) {
  Read(0x08);
  Request(0x03);  // BOOT from OP: some stacks fall to SAFEOP with the error bit
  Read(0x14, 0x0011);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
}

TEST_F(AlMachineTest, ErrorOfUnknownAgeIsMarked) {
  Request(0x04);
  Read(0x12, 0x0017);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
  EXPECT_FALSE(log.last_answered.state_before_known);
}

TEST_F(AlMachineTest, AcceptedIllegal) {
  Read(0x01);
  Request(0x08);
  Read(0x08);
  EXPECT_THAT(log.lines, ElementsAre("accepted-illegal"));
}

TEST_F(AlMachineTest, OfSeveralRequestsTheOneThatHadToFailIsTheOneRefused) {
  Read(0x01);
  Request(0x08);
  const FrameNo illegal = log.last_judged.request.frame.number;
  Request(0x02);
  Read(0x11, 0x0011);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
  EXPECT_EQ(log.last_answered.request.frame.number, illegal);
}

// --- acknowledge
// --------------------------------------------------------------------------------------------------------

TEST_F(AlMachineTest, ErrorHasToBeAcknowledged) {
  Read(0x01);
  Request(0x08);
  Read(0x11, 0x0011);
  Request(0x02);
  EXPECT_EQ(log.judged.back(), "needs-acknowledge");
  Request(0x01);
  EXPECT_EQ(log.judged.back(), "legal") << "INIT acknowledges by itself";
  Read(0x01, 0);
  EXPECT_THAT(log.lines, ElementsAre("refused", "cleared", "reached"));
}

TEST_F(AlMachineTest, AcknowledgeAndNextStateInOne) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x14);
  EXPECT_EQ(log.judged.back(), "legal");
  Read(0x12, 0x001D);
  Read(0x04, 0);
  EXPECT_THAT(log.lines, ElementsAre("refused", "cleared", "reached"));
}

TEST_F(AlMachineTest, AcknowledgedErrorMayStayAWhile) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x12);
  for (int i = 0; i < 190; ++i) Read(0x12, 0x001D);  // 190 ms
  EXPECT_THAT(log.lines, ElementsAre("refused"));
  After(20 * kMs);
  Read(0x12, 0x001D);
  EXPECT_THAT(log.lines, ElementsAre("refused", "refused"));
}

TEST_F(AlMachineTest, AcknowledgedErrorWithoutTimeStampsIsCountedByReads) {
  timed = false;
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x12);
  for (int i = 0; i < 200; ++i) Read(0x12, 0x001D);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
  Read(0x12, 0x001D);
  EXPECT_THAT(log.lines, ElementsAre("refused", "refused"));
}

TEST_F(AlMachineTest, AnotherCodeIsAnotherRefusal) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x14);
  Read(0x12, 0x001E);
  EXPECT_THAT(log.lines, ElementsAre("refused", "refused"));
  EXPECT_EQ(log.last_answered.code, 0x001E);
}

TEST_F(AlMachineTest, SecondAcknowledgeBeforeTheFirstWorked) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x12);
  Read(0x12, 0x001D);
  Request(0x14);
  Read(0x12, 0x001D);
  Read(0x04, 0);
  EXPECT_THAT(log.lines, ElementsAre("refused", "cleared", "reached"));
}

TEST_F(AlMachineTest, RequestBehindTheAcknowledgeWithoutARead) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x12);
  Request(0x04);
  EXPECT_EQ(log.judged.back(), "legal");
  Read(0x12, 0x001D);
  Read(0x04, 0);
  EXPECT_THAT(log.lines, ElementsAre("refused", "cleared", "reached"));
}

TEST_F(AlMachineTest, LostAcknowledgeMayOrMayNotHaveWorked) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  Request(0x12, track::Acceptance::kUnknown);
  Request(0x04);
  EXPECT_EQ(log.judged.back(), "legal");
}

TEST_F(AlMachineTest, LostAcknowledgeThatShowsLate) {
  Read(0x02);
  Request(0x04);
  Read(0x12, 0x001D);
  machine.OnRequestSent(Frame(), esc::AlWord{0x12});
  Request(0x04);
  EXPECT_EQ(log.judged.back(), "legal");
}

TEST_F(AlMachineTest, ErrorThatOutlivesALostAcknowledgeIsTheSame) {
  Read(0x02);
  Request(0x04);
  Read(0x12);
  Request(0x12, track::Acceptance::kUnknown);
  Read(0x12);
  EXPECT_EQ(log.repeated, 1);
  ReadCode(0x001D);
  EXPECT_THAT(log.lines, ElementsAre("refused", "code 29"));
  Request(0x04);
  EXPECT_EQ(log.judged.back(), "needs-acknowledge");
}

// --- slaves that copy AL Control
// ----------------------------------------------------------------------------------------

TEST_F(AlMachineTest, EchoOfTheAcknowledgeIsNoError) {
  Request(0x11);
  Read(0x11);
  Request(0x12);
  Read(0x12);
  Read(0x12, 0);
  Request(0x04);
  Read(0x04);
  Request(0x18);
  Read(0x18);
  EXPECT_THAT(log.lines, ElementsAre("reached", "reached", "reached", "reached"));
  EXPECT_TRUE(machine.SettledIn(esc::AlState::OP));
}

TEST_F(AlMachineTest, EchoIsPossibleOnlyWithDeviceEmulation) {
  machine.SetDeviceEmulation(false);
  Read(0x01);
  Request(0x12);
  Read(0x12);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
}

TEST_F(AlMachineTest, WithDeviceEmulationTheBitIsAnEchoOfARequestThatTheCaptureMisses) {
  machine.SetDeviceEmulation(true);
  Request(0x11);
  Read(0x11);
  Read(0x12);
  EXPECT_THAT(log.lines, ElementsAre("reached"));
}

TEST_F(AlMachineTest, ARequestOfNoStateWhoseReturnIsMissingExplainsTheError) {
  Read(0x02);
  machine.OnRequestSent(Frame(), esc::AlWord{0x05});
  After(kMs);
  Read(0x12, 0x0011);
  EXPECT_TRUE(log.lines.empty());
  EXPECT_EQ(machine.possible().single(), 0x02);
}

TEST_F(AlMachineTest, SlaveThatClearedTheBitOnceDoesNotEcho) {
  Read(0x01);
  Request(0x12);
  Read(0x02);  // a copy would show 0x12
  Read(0x12);
  EXPECT_THAT(log.lines, ElementsAre("reached", "by-itself 2>18"));
}

TEST_F(AlMachineTest, ErrorWithACodeIsNoEcho) {
  Request(0x11);
  Read(0x11, 0x0017);
  After(300 * kMs);
  Read(0x11, 0x0017);
  EXPECT_THAT(log.lines, ElementsAre("refused"));
}

TEST_F(AlMachineTest, RefusalProvesAProcessor) {
  Read(0x01);
  Request(0x08);
  Read(0x11);  // refused; AL Control had no bit 4 to copy
  Request(0x11);
  Read(0x11);  // not an echo: the acknowledge has not worked yet
  EXPECT_THAT(log.lines, ElementsAre("refused"));
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("refused", "cleared", "reached"));
}

// --- changes by itself
// --------------------------------------------------------------------------------------------------

TEST_F(AlMachineTest, FallOutOfOperation) {
  Read(0x08);
  const FrameNo good = number;
  Read(0x14, 0x001B);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>20"));
  EXPECT_EQ(log.last_change.before_since, good);
  EXPECT_EQ(log.last_change.code, 0x001B);
  Read(0x14, 0x001B);
  EXPECT_EQ(log.repeated, 1);
}

TEST_F(AlMachineTest, FallsFurtherWithTheErrorSet) {
  Read(0x08);
  Read(0x14, 0x001B);
  Read(0x12, 0x001D);
  Read(0x01, 0);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>20", "by-itself 20>18", "cleared", "by-itself 18>1"));
}

TEST_F(AlMachineTest, ErrorBitInTheSameState) {
  Read(0x04);
  Read(0x14);
  ReadCode(0x0034);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 4>20", "code 52"));
}

TEST_F(AlMachineTest, FirstReadProvesNothing) {
  Read(0x14, 0x001B);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, RisingByItselfIsSomebodyElsesMaster) {
  Read(0x01);
  Read(0x02);
  Read(0x04);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, StatesPassedOnTheWayDown) {
  Read(0x08);
  Request(0x01);
  Read(0x04);
  Read(0x02);
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("reached"));
}

TEST_F(AlMachineTest, FallBelowTheRequestedStateIsNotTheAnswer) {
  Read(0x08);
  Request(0x04);
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>1"));
  After(20'000 * kMs);
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>1")) << "and SAFEOP is not waited for any more";
}

TEST_F(AlMachineTest, RequestUnderWayExplainsAFall) {
  Read(0x08);
  machine.OnRequestSent(Frame(), esc::AlWord{0x01});
  Read(0x04);
  Read(0x01);
  EXPECT_THAT(log.lines, IsEmpty());
  Returned(0x01, track::Acceptance::kAccepted);
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("reached"));
}

TEST_F(AlMachineTest, RequestUnderWayExplainsAnError) {
  Read(0x04);
  machine.OnRequestSent(Frame(), esc::AlWord{0x08});
  Read(0x14);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, LostRequestExplainsAFallForSomeTime) {
  Read(0x08);
  Request(0x02, track::Acceptance::kUnknown);
  Read(0x04);
  Read(0x02);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, LostRequestDoesNotExplainForEver) {
  Read(0x08);
  Request(0x02, track::Acceptance::kUnknown);
  After(9'000 * kMs);
  Read(0x08);
  After(2'000 * kMs);
  Read(0x08);
  Read(0x02);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>2"));
}

TEST_F(AlMachineTest, EarlierRequestsExplainWhatComesLate) {
  Read(0x08);
  Request(0x02);
  Request(0x04);
  Read(0x02);
  Read(0x04);
  EXPECT_THAT(log.lines, ElementsAre("reached"));
}

TEST_F(AlMachineTest, AfterForgettingNothingIsUnexpected) {
  Read(0x08);
  machine.Forget(Frame());
  EXPECT_TRUE(machine.possible().empty());
  Read(0x14, 0x001B);
  EXPECT_THAT(log.lines, IsEmpty());
}

// --- broadcasts that tell the state but not whose error it is
// -------------------------------------------------------------

TEST_F(AlMachineTest, BroadcastShowsTheFallOfAll) {
  Read(0x08);
  ReadStateOnly(0x04);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>4"));
  Read(0x14);
  EXPECT_EQ(log.repeated, 1);
  ReadCode(0x001B);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>4", "code 27"));
}

TEST_F(AlMachineTest, BroadcastOfARequestedStateIsNoFall) {
  Read(0x08);
  Request(0x04);
  ReadStateOnly(0x04);
  Read(0x14, 0x001B);
  EXPECT_THAT(log.lines, ElementsAre("refused")) << "whether it is the answer, only the slave's own read shows";
}

TEST_F(AlMachineTest, BroadcastOfTheSameStateForgetsNothing) {
  Read(0x08);
  ReadStateOnly(0x08);
  Read(0x14, 0x001B);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>20"));
}

// --- time-outs
// ----------------------------------------------------------------------------------------------------------

struct Limit {
  const char* name;
  std::uint16_t from;
  std::uint16_t to;
  std::int64_t limit_ms;
};

class AlTimeoutTest : public AlMachineTest, public ::testing::WithParamInterface<Limit> {};

TEST_P(AlTimeoutTest, JustInTimeAndJustTooLate) {
  const Limit& limit = GetParam();
  Read(limit.from);
  Request(limit.to);  // 1 ms passes behind it
  After((limit.limit_ms - 1) * kMs);
  Read(limit.from);  // exactly at the limit; 1 ms passes
  EXPECT_THAT(log.lines, IsEmpty());
  Read(limit.from);
  EXPECT_THAT(log.lines, ElementsAre("overdue"));
  EXPECT_EQ(log.last_overdue.limit_ns, limit.limit_ms * kMs);
  EXPECT_EQ(log.last_overdue.waited_ns, (limit.limit_ms + 1) * kMs);
  EXPECT_EQ(log.last_overdue.polls, 2U);
  Read(limit.from);
  EXPECT_THAT(log.lines, ElementsAre("overdue")) << "once a request";
}

// INIT to PREOP and BOOT 3 s, to SAFEOP and OP 10 s, downwards 5 s (esc-reference 5.7).
INSTANTIATE_TEST_SUITE_P(Limits, AlTimeoutTest,
                         ::testing::Values(Limit{"InitToPreop", 1, 2, 3000}, Limit{"InitToBoot", 1, 3, 3000},
                                           Limit{"PreopToSafeop", 2, 4, 10000}, Limit{"SafeopToOp", 4, 8, 10000},
                                           Limit{"OpToSafeop", 8, 4, 5000}, Limit{"OpToPreop", 8, 2, 5000},
                                           Limit{"OpToInit", 8, 1, 5000}, Limit{"SafeopToPreop", 4, 2, 5000},
                                           Limit{"PreopToInit", 2, 1, 5000}, Limit{"BootToInit", 3, 1, 5000}),
                         [](const ::testing::TestParamInfo<Limit>& of) { return of.param.name; });

TEST_F(AlMachineTest, LimitsCanBeChanged) {
  AlTimeouts timeouts;
  timeouts.to_preop_ns = 100 * kMs;
  machine.SetTimeouts(timeouts);
  Read(0x01);
  Request(0x02);
  After(100 * kMs);
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("overdue"));
}

TEST_F(AlMachineTest, RepeatedRequestDoesNotStartTheClockAnew) {
  Read(0x01);
  Request(0x02);
  After(2'000 * kMs);
  Read(0x01);
  Request(0x02);
  After(1'500 * kMs);
  Read(0x01);
  EXPECT_THAT(log.lines, ElementsAre("overdue"));
  EXPECT_EQ(log.last_overdue.request.repetitions, 1U);
}

TEST_F(AlMachineTest, AnotherRequestStartsTheClockAnew) {
  Read(0x01);
  Request(0x02);
  After(2'000 * kMs);
  Read(0x01);
  Request(0x12);
  After(1'500 * kMs);
  Read(0x01);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, WithoutTimeStampsNothingIsLate) {
  timed = false;
  Read(0x01);
  Request(0x02);
  After(60'000 * kMs);
  Read(0x01);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, IgnoredRequestIsNotWaitedFor) {
  Read(0x04);
  Read(0x14, 0x001B);
  Request(0x08);
  After(60'000 * kMs);
  Read(0x14, 0x001B);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 4>20"));
}

// --- what the capture shows
// ---------------------------------------------------------------------------------------------

TEST_F(AlMachineTest, CountsForRulesThatSayWhereTheyCouldNotJudge) {
  Read(0x01);
  EXPECT_EQ(machine.status_reads(), 1U);
  EXPECT_EQ(machine.reads_after_request(), 0U);
  Request(0x02, track::Acceptance::kRefused);
  EXPECT_EQ(machine.requests(), 0U);
  Request(0x02);
  EXPECT_EQ(machine.requests(), 1U);
  Read(0x02);
  EXPECT_EQ(machine.reads_after_request(), 1U);
}

// --- waits over a capture gap
// ---------------------------------------------------------------------------------------------------------

TEST_F(AlMachineTest, WaitGoesOnOverAShortGap) {
  Wait();
  Gap(400 * kMs);
  Read(0x02);
  After(10'000 * kMs);
  Read(0x02);
  ASSERT_THAT(log.lines, ElementsAre("overdue"));
  EXPECT_TRUE(log.last_overdue.request.over_gap);
}

TEST_F(AlMachineTest, RefusalAfterAGapIsOfARequestThatStayedOpenOverIt) {
  Wait();
  Gap(400 * kMs);
  Read(0x02);
  Read(0x12, 0x001E);
  ASSERT_THAT(log.lines, ElementsAre("refused"));
  EXPECT_TRUE(log.last_answered.request.over_gap);
}

/// The error is in the first read after it, and no read lies between the request and the gap.
TEST_F(AlMachineTest, ErrorRightAfterAShortGapAnswersTheRequestBeforeIt) {
  Read(0x02);
  Request(0x04);
  Gap(400 * kMs);
  Read(0x12, 0x001E);
  ASSERT_THAT(log.lines, ElementsAre("refused"));
  EXPECT_TRUE(log.last_answered.request.over_gap);
  EXPECT_TRUE(log.last_answered.state_before_known);
}

TEST_F(AlMachineTest, ErrorRightAfterALongGapAnswersNothing) {
  Read(0x02);
  Request(0x04);
  Gap(600 * kMs);
  Read(0x12, 0x001E);
  EXPECT_THAT(log.lines, IsEmpty());
}

/// A master that looks once a second: the gap counts, not the time between two looks.
TEST_F(AlMachineTest, WaitGoesOnWhereTheMasterLooksSeldom) {
  Wait();
  After(800 * kMs);
  Gap(10 * kMs);
  After(800 * kMs);
  Read(0x02);
  After(10'000 * kMs);
  Read(0x02);
  EXPECT_THAT(log.lines, ElementsAre("overdue"));
}

/// Some masters write the request again each time they look.
TEST_F(AlMachineTest, WaitGoesOnWhereTheMasterRepeatsItsRequest) {
  Wait();
  Gap(10 * kMs);
  Request(0x04);
  Read(0x02);
  After(10'000 * kMs);
  Request(0x04);
  Read(0x02);
  ASSERT_THAT(log.lines, ElementsAre("overdue"));
  EXPECT_TRUE(log.last_overdue.request.over_gap);
  EXPECT_EQ(log.last_overdue.request.repetitions, 2U);
}

TEST_F(AlMachineTest, WaitEndsWhereTheMasterRequestsAnotherStateAfterTheGap) {
  Wait();
  Gap(10 * kMs);
  Request(0x01);
  Read(0x02);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, WaitEndsWithALongGap) {
  Wait();
  Gap(600 * kMs);
  Read(0x02);
  After(10'000 * kMs);
  Read(0x02);
  EXPECT_THAT(log.lines, IsEmpty());
}

/// Another recording is appended, whose clock is earlier.
TEST_F(AlMachineTest, WaitEndsWhereTheClockGoesBack) {
  After(5'000 * kMs);
  Wait();
  Gap(-5'000 * kMs);
  Read(0x02);
  After(20'000 * kMs);
  Read(0x02);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, WaitEndsWhereTheSlaveIsOutOfSightAgain) {
  Wait();
  Gap(100 * kMs);
  machine.Forget(Frame());
  Read(0x02);
  After(10'000 * kMs);
  Read(0x02);
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST_F(AlMachineTest, StatusThatIsNoStateIsDisturbedOnceAndAFallWhenItStays) {
  Read(0x08);
  Read(0x00);
  Read(0x08);
  Read(0x07);
  Read(0x08);
  EXPECT_THAT(log.lines, IsEmpty());
  Read(0x00);
  Read(0x07);
  Read(0x00);
  EXPECT_THAT(log.lines, ElementsAre("by-itself 8>7"));
  EXPECT_TRUE(machine.possible().empty());
  EXPECT_EQ(machine.status_reads(), 8U);
}

}  // namespace
}  // namespace ecaudit::model
