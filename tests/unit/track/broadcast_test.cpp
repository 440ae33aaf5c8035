// Broadcasts: who took part, and what an OR over all slaves tells of each (esc-reference 2.3).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/wiring/event_bus.h"
#include "tests/unit/track/event_log.h"

namespace ecaudit::track::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

/// Three slaves, all in PREOP, each asked.
std::string ThreeInPreop() {
  return R"(
@slaves 3
+1ms BRD  0x0000   11 00
+1ms APWR 0:0x0010 01 10
+1ms APWR 1:0x0010 02 10
+1ms APWR 2:0x0010 03 10
+1ms FPRD 0x1001:0x0130 02 00 & FPRD 0x1002:0x0130 02 00 & FPRD 0x1003:0x0130 02 00
)";
}

std::vector<std::string> StatesAfter(std::string_view more, std::string_view prefix = "state") {
  std::vector<std::string> lines = Decode(ThreeInPreop() + std::string(more)).log->Only(prefix);
  if (prefix == "state") lines.erase(lines.begin(), lines.begin() + 3);
  return lines;
}

TEST(Broadcast, OneStateAndEverybodyCounted) {
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 04 00\n"),
              ElementsAre("state 0 0x0002 -> 0x0004", "state 1 0x0002 -> 0x0004", "state 2 0x0002 -> 0x0004"));
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 02 00\n"), IsEmpty());
}

TEST(Broadcast, MailboxesThatAllAreGivenAtOnceKeepTheirRepeatBit) {
  const std::string settings = "+1ms BWR 0x0800 00 10 80 00 26 00 01 00 80 10 80 00 22 00 03 00\n";
  EXPECT_THAT(StatesAfter(settings, "repeat"), IsEmpty()) << "settings are no request";
  EXPECT_THAT(StatesAfter(settings + "+1ms FPWR 0x1002:0x080E 03\n", "repeat"), IsEmpty()) << "as it stood";
  EXPECT_THAT(StatesAfter(settings + "+1ms FPWR 0x1002:0x080E 01\n", "repeat"), ElementsAre("repeat 1 requested"));
  EXPECT_THAT(StatesAfter(settings + "+1ms BWR 0x080E 01\n", "repeat"),
              ElementsAre("repeat 0 requested", "repeat 1 requested", "repeat 2 requested"));
  EXPECT_THAT(StatesAfter(settings + settings + "+1ms FPWR 0x1001:0x080E 01\n+1ms FPRD 0x1001:0x080F 00\n", "repeat"),
              ElementsAre("repeat 0 requested", "repeat 0 acknowledged"));
}

TEST(Broadcast, NotEverybodyCounted) {
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 04 00 wkc=2\n"), IsEmpty());
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 00 00 wkc=0\n"), IsEmpty());
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 04 00 wkc=2\n", "forgotten"), IsEmpty());
}

TEST(Broadcast, SeveralStates) {
  // PREOP and SAFEOP: whoever was in PREOP still may be.
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 06 00\n"), IsEmpty());
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 06 00\n", "forgotten"), IsEmpty());
  // SAFEOP and OP: nobody is in PREOP any more, and who is where cannot be told.
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 0C 00\n", "forgotten"),
              ElementsAre("forgotten 0", "forgotten 1", "forgotten 2"));
  // 3 is INIT and PREOP, or BOOT.
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 03 00\n"), IsEmpty());
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 03 00\n", "forgotten"), IsEmpty());
}

TEST(Broadcast, ErrorBitOfOneSlave) {
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 14 00\n"), ElementsAre("state 0 0x0002 -> 0x0004 (error bit of somebody)",
                                                                  "state 1 0x0002 -> 0x0004 (error bit of somebody)",
                                                                  "state 2 0x0002 -> 0x0004 (error bit of somebody)"));
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 12 00\n"), IsEmpty()) << "state as before: whose bit it is, nobody knows";
}

TEST(Broadcast, IdentificationBitsOfOthersAreNotMine) {
  // Bit 5 (identification loaded) of one slave shows in the OR.
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 22 00\n"), IsEmpty());
  EXPECT_THAT(StatesAfter("+1ms FPRD 0x1001:0x0130 22 00\n+1ms BRD 0x0130 22 00\n+1ms FPRD 0x1001:0x0130 22 00\n"),
              ElementsAre("state 0 0x0002 -> 0x0022"));
}

TEST(Broadcast, WhatTheMasterSentSetProvesNothing) {
  EXPECT_THAT(StatesAfter("+1ms BRD 0x0130 08 00 -> 08 00\n"), IsEmpty());
}

TEST(Broadcast, OfAnotherProgramConcernsSlavesThatAnswerItOnly) {
  constexpr std::string_view kOther = "@mac 00:0a:35:01:02:03\n";
  constexpr std::string_view kPoll = "+1ms BRD 0x0130 04 00\n";
  EXPECT_THAT(StatesAfter(std::string(kOther) + std::string(kPoll)), IsEmpty()) << "three slaves, but of which bus?";
  EXPECT_THAT(StatesAfter(std::string(kOther) + "+1ms FPRD 0x1002:0x0130 02 00\n" + std::string(kPoll)),
              ElementsAre("state 0 0x0002 -> 0x0004", "state 1 0x0002 -> 0x0004", "state 2 0x0002 -> 0x0004"))
      << "one slave answered both";
}

TEST(Broadcast, TheCountOfAnotherProgramPlacesNoSlave) {
  const Decoded d = Decode(R"(
@slaves 1
@mac 00:0a:35:01:02:03
+1ms BRD  0x0130 01 00
@mac 01:01:01:01:01:01
+1ms FPRD 0x1001:0x0130 14 00 00 00 1B 00
@mac 00:0a:35:01:02:03
+1ms BRD  0x0130 01 00
)");
  EXPECT_THAT(d.log->Only("state"), ElementsAre("state 0 ? -> 0x0014 code 0x001b"));
  EXPECT_EQ(d.slaves()[0].position.if_known(), nullptr);
}

TEST(Broadcast, ASingleSlaveIsReadExactly) {
  const Decoded d = Decode(R"(
+1ms BRD 0x0130 01 00 00 00 00 00
+1ms APRD 0:0x0130 01 00
+1ms BRD 0x0130 11 00 00 00 17 00
)");
  EXPECT_THAT(d.log->Only("state"), ElementsAre("state 0 ? -> 0x0001", "state 0 0x0001 -> 0x0011 code 0x0017"));
}

TEST(Broadcast, OfASingleSlaveConcernsNoSlaveThatLeft) {
  // Two of three slaves went away; what the one left says is not theirs.
  const std::vector<std::string> lines =
      Decode(ThreeInPreop() + "@slaves 1\n+1ms BRD 0x0130 14 00 00 00 1B 00\n").log->Only("state");
  EXPECT_THAT(lines, Contains("state 0 0x0002 -> 0x0014 code 0x001b"));
  EXPECT_THAT(lines, Not(Contains(::testing::StartsWith("state 1 0x0002"))));
}

/// Takes polls in place of the single reads.
class PollLog final : public EventBus {
 public:
  PollLog() { ListenTo<AlStatusRead, AlPoll>(Stage::kModel, *this); }
  void On(const AlStatusRead& e) {
    said.push_back("read " + std::to_string(e.slave) + " in " + std::to_string(e.frame.number));
  }
  void On(const AlPoll& e) {
    said.push_back("poll of " + std::to_string(e.slaves.size()) + " in " + std::to_string(e.frame.number) + ": " +
                   std::to_string(e.status.raw));
    e.taken = takes;
  }
  std::vector<std::string> said;
  bool takes = true;
};

/// What is said behind the three reads of ThreeInPreop(), which is 5 frames out and 5 back.
std::vector<std::string> PollsOf(std::string_view more, bool takes = true) {
  const Result<Trace> trace = Trace::Parse(ThreeInPreop() + std::string(more));
  EXPECT_TRUE(trace.has_value());
  PollLog log;
  log.takes = takes;
  Pipeline pipeline(log);
  MemorySource source(trace->Packets());
  pipeline.Run(source);
  return {log.said.begin() + 3, log.said.end()};
}

TEST(BroadcastPoll, ReportedOnceWhereEverySlaveIsAsBefore) {
  constexpr std::string_view kPoll = "+1ms BRD 0x0130 02 00\n";
  const std::string three = std::string(kPoll) + std::string(kPoll) + std::string(kPoll);
  EXPECT_THAT(PollsOf(three),
              ElementsAre("read 0 in 12", "read 1 in 12", "read 2 in 12", "poll of 3 in 14: 2", "poll of 3 in 16: 2"));
  EXPECT_THAT(PollsOf(std::string(kPoll) + std::string(kPoll), false),
              ElementsAre("read 0 in 12", "read 1 in 12", "read 2 in 12", "poll of 3 in 14: 2", "read 0 in 14",
                          "read 1 in 14", "read 2 in 14"));
}

TEST(BroadcastPoll, NotWhereAStateOrTheBusChanged) {
  constexpr std::string_view kPoll = "+1ms BRD 0x0130 02 00\n";
  const auto polls = [&](std::string_view between) {
    const std::vector<std::string> said = PollsOf(std::string(kPoll) + std::string(between) + std::string(kPoll));
    return std::count_if(said.begin(), said.end(), [](const std::string& line) { return line.starts_with("poll"); });
  };
  EXPECT_EQ(polls(""), 1);
  EXPECT_EQ(polls("+1ms FPRD 0x1002:0x0130 02 00\n"), 1) << "read once more, as before";
  EXPECT_EQ(polls("+1ms FPRD 0x1002:0x0130 12 00\n"), 0) << "one slave has its error bit set";
  EXPECT_EQ(polls("+1ms BRD 0x0130 04 00\n"), 0) << "all went to SAFEOP and back";
  EXPECT_EQ(polls("+1ms BRD 0x0130 06 00\n"), 0) << "some may have gone";
  EXPECT_EQ(polls("@slaves 2\n+1ms BRD 0x0000 11 00\n"), 0) << "one slave fewer";
  EXPECT_EQ(polls("+1ms APWR 1:0x0010 09 10\n"), 0) << "another station address";
  EXPECT_EQ(polls("+1ms BRD 0x0130 02 00 wkc=2\n"), 1) << "tells nothing";
}

TEST(Broadcast, WriteThatEverybodyTook) {
  const Decoded d = Decode(ThreeInPreop() + "+1ms BWR 0x0420 E8 03\n");
  for (SlaveId s = 0; s < 3; ++s) EXPECT_EQ(d.Register(s, 0x0420), "0x03e8");
  EXPECT_EQ(d.log->accesses.back().acceptance, Acceptance::kAccepted);
  EXPECT_TRUE(d.log->accesses.back().broadcast);
}

TEST(Broadcast, WriteThatSomeTook) {
  const Decoded d = Decode(ThreeInPreop() + "+1ms BWR 0x0420 E8 03\n+1ms BWR 0x0420 D0 07 wkc=2\n");
  for (SlaveId s = 0; s < 3; ++s) EXPECT_EQ(d.Register(s, 0x0420), "?") << "who took it, nobody knows";
  EXPECT_EQ(d.log->accesses.back().acceptance, Acceptance::kUnknown);
}

TEST(Broadcast, WriteThatNoSlaveAccepted) {
  const Decoded d = Decode(ThreeInPreop() + "+1ms BWR 0x0420 E8 03\n+1ms BWR 0x0420 D0 07 wkc=0\n");
  for (SlaveId s = 0; s < 3; ++s) EXPECT_EQ(d.Register(s, 0x0420), "0x03e8");
  EXPECT_EQ(d.log->accesses.back().acceptance, Acceptance::kRefused);
}

TEST(Broadcast, ReadWriteCountsThree) {
  const Decoded d = Decode(ThreeInPreop() + "+1ms BRW 0x0420 E8 03\n");
  EXPECT_EQ(d.log->answers.back().wkc, 9);
  for (SlaveId s = 0; s < 3; ++s) EXPECT_EQ(d.Register(s, 0x0420), "0x03e8");
  const Decoded partly = Decode(ThreeInPreop() + "+1ms BRW 0x0420 E8 03 wkc=3\n");
  for (SlaveId s = 0; s < 3; ++s) EXPECT_EQ(partly.Register(s, 0x0420), "?");
}

TEST(Broadcast, SlavesMetLaterHaveTakenIt) {
  // Masters configure by broadcast before they address anybody.
  const Decoded d = Decode("@slaves 2\n+1ms BWR 0x0420 E8 03\n+1ms FPRD 0x1002:0x0130 01 00\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(Broadcast, SlavesThatJoinLaterHaveNotTakenIt) {
  // One more slave on the bus since the broadcast.
  const Decoded d =
      Decode("@slaves 1\n+1ms BWR 0x0420 E8 03\n@slaves 2\n+1ms APRD 1:0x0130 01 00\n+1ms APRD 0:0x0130 01 00\n");
  EXPECT_EQ(d.Register(0, 0x0420), "?");
  EXPECT_EQ(*d.slaves()[0].position.if_known(), 1);
}

TEST(Broadcast, BlankedMappingIsInferredForWhoDidNotCount) {
  // ethercrab blanks 16 FMMUs, of which a slave may have 3: working counter below the count, zeros either way.
  const Decoded d = Decode(ThreeInPreop() + "+1ms BWR 0x0600 len=16 wkc=2\n");
  EXPECT_EQ(d.Register(0, 0x0600), "0x0000?");
}

TEST(Broadcast, AlRequests) {
  const Decoded d = Decode(ThreeInPreop() + "+1ms BWR 0x0120 04 00\n");
  EXPECT_THAT(d.log->Only("sent"), ElementsAre("sent 0 <- 0x0004", "sent 1 <- 0x0004", "sent 2 <- 0x0004"));
  EXPECT_THAT(d.log->Only("request"), ElementsAre("request 0 <- 0x0004 accepted", "request 1 <- 0x0004 accepted",
                                                  "request 2 <- 0x0004 accepted"));
  const Decoded partly = Decode(ThreeInPreop() + "+1ms BWR 0x0120 04 00 wkc=2\n");
  EXPECT_THAT(partly.log->Only("request"),
              ElementsAre("request 0 <- 0x0004 unknown", "request 1 <- 0x0004 unknown", "request 2 <- 0x0004 unknown"));
}

TEST(Broadcast, WhoLeftTheBusIsNotRequested) {
  const Decoded d = Decode(ThreeInPreop() + "@slaves 2\n+1ms BRD 0x0130 02 00\n+1ms BWR 0x0120 04 00\n");
  EXPECT_THAT(d.log->Only("request"), ElementsAre("request 0 <- 0x0004 accepted", "request 1 <- 0x0004 accepted"));
  EXPECT_THAT(d.log->Only("sent"), ElementsAre("sent 0 <- 0x0004", "sent 1 <- 0x0004"));
}

// --- the number of slaves -------------------------------------------------------------------------------------------

TEST(SlaveCountEvent, OnlyChangesAreReported) {
  const Decoded d = Decode(R"(
@slaves 3
+1ms BRD 0x0130 01 00
+1ms BRD 0x0130 01 00 wkc=1
+1ms APRD 0:0x0130 01 00
@slaves 2
+1ms BWR 0x0103 00
@slaves 3
+1ms APRD 7:0x0130 00 00 wkc=0
)");
  EXPECT_THAT(d.log->Only("count"), ElementsAre("count 3", "count 3 -> 2", "count 2 -> 3"));
}

TEST(SlaveCountEvent, CirculatingFramesDoNotCount) {
  const Decoded d = Decode("@slaves 3\n+1ms BRD 0x0130 01 00\n+1ms BRD 0x0130 01 00 radp=6 wkc=6 @circulating\n");
  EXPECT_THAT(d.log->Only("count"), ElementsAre("count 3"));
}

/// The third slave is gone for a while.
std::string Returned() {
  return ThreeInPreop() + R"(
+1ms BWR 0x0420 E8 03
@slaves 2
+1ms BRD 0x0130 02 00
@slaves 3
+1ms BRD 0x0000 11 00
)";
}

TEST(SlaveCountEvent, TheStateOfWhoComesBackIsNotKnownAnyMore) {
  const Decoded d = Decode(Returned());
  EXPECT_THAT(d.log->Only("forgotten"), ElementsAre("forgotten 2"));
  EXPECT_EQ(d.network().state(2).al_status.if_known(), nullptr);
  EXPECT_EQ(d.Register(1, 0x0420), "0x03e8");
}

TEST(SlaveCountEvent, WhoComesBackWithItsAddressOrInAnotherStateThanInitHoldsWhatItHeld) {
  for (const char* shows : {"+1ms FPRD 0x1003:0x0300 00 00\n", "+1ms APRD 2:0x0010 03 10\n",
                            "+1ms APRD 2:0x0130 14 00 00 00 1B 00\n", "+1ms BRD 0x0130 02 00\n"}) {
    const Decoded d = Decode(Returned() + shows + "+1ms APWR 2:0x0010 03 10\n");
    EXPECT_EQ(d.Register(2, 0x0420), "0x03e8") << shows;
  }
}

TEST(SlaveCountEvent, WhoComesBackInInitOrIsSetUpAgainMayHaveBeenWithoutPower) {
  for (const char* shows : {"+1ms APRD 2:0x0010 00 00\n", "+1ms APRD 2:0x0130 01 00\n", "+1ms APWR 2:0x0010 03 10\n",
                            "+1ms APRD 2:0x0600 00 00\n"}) {
    const Decoded d = Decode(Returned() + shows);
    EXPECT_EQ(d.Register(2, 0x0420), "?") << shows;
    EXPECT_EQ(d.log->Only("forgotten").size(), 2U) << shows;
  }
}

TEST(SlaveCountEvent, EachDatagramBringsItsOwnCount) {
  const Decoded d = Decode(ThreeInPreop() + "@slaves 2\n+1ms BRD 0x0130 02 00\n");
  ASSERT_FALSE(d.log->answers.empty());
  EXPECT_EQ(d.log->answers.front().slaves_passed, 3);
  EXPECT_EQ(d.log->answers.back().slaves_passed, 2);
}

}  // namespace
}  // namespace ecaudit::track::test
