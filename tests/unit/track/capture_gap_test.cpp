// What is known of the slaves behind a hole in the capture: what the frames that are missing may have changed is open.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/track/event_log.h"

namespace ecaudit::track::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Two slaves with a watchdog register and an FMMU each; enough frames to show how the master numbers them. The copy
/// that is missing shows that the capture misses packets.
constexpr std::string_view kTwo =
    "@slaves 2\n"
    "+1ms BRD 0x0000 11 00 times=20\n"
    "+1ms BRD 0x0000 11 00 @returned-only\n"
    "+1ms APWR 0:0x0010 01 10\n"
    "+1ms APWR 1:0x0010 02 10\n"
    "+1ms FPWR 0x1001:0x0420 E8 03\n"
    "+1ms FPWR 0x1002:0x0420 E8 03\n";

Decoded TwoThen(std::string_view more) {
  return Decode(std::string(kTwo) + std::string(more));
}

TEST(GapBefore, AfterItNothingIsKnown) {
  const Decoded d =
      TwoThen("+1ms FPRD 0x1001:0x0130 02 00\n+1ms FPRD 0x1001:0x0130 02 00 @missed\n+1ms BRD 0x0000 11 00\n");
  EXPECT_THAT(d.log->Only("hole"), ElementsAre("hole 52"));
  EXPECT_THAT(d.log->Only("forgotten"), ElementsAre("forgotten 0"));
  EXPECT_EQ(d.Register(0, 0x0420), "?");
  EXPECT_EQ(d.Register(1, 0x0420), "?");
  EXPECT_THAT(d.log->Only("count"), ElementsAre("count 2", "count 2"));  // counted anew, not changed
}

TEST(GapBefore, WhereOnlyNumbersAreLeftOutNothingIsForgotten) {
  const Decoded d = Decode(
      "@slaves 2\n+1ms BRD 0x0000 11 00 times=20\n+1ms APWR 0:0x0010 01 10\n+1ms FPWR 0x1001:0x0420 E8 03\n"
      "+1ms FPRD 0x1001:0x0130 02 00 times=20\n+1ms FPRD 0x1001:0x0130 02 00 @missed times=3\n+1ms BRD 0x0000 11 00\n");
  EXPECT_THAT(d.log->Only("hole"), IsEmpty());
  EXPECT_THAT(d.log->Only("skip"), ElementsAre("skip 85"));
  EXPECT_THAT(d.log->Only("forgotten"), IsEmpty());
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(GapBefore, WithoutOneNothingIsForgotten) {
  const Decoded d = TwoThen("+1ms FPRD 0x1001:0x0130 02 00\n+3ms BRD 0x0000 11 00\n");
  EXPECT_THAT(d.log->Only("hole"), IsEmpty());
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(GapBefore, SlavesInOpWhoseWorkingCounterGoesOnAreStillThere) {
  const Decoded d = TwoThen(
      "+1ms BRD 0x0130 08 00\n+1ms LRW 0x1000 01 02 wkc=6 times=5\n+1ms LRW 0x1000 01 02 wkc=6 @missed times=3\n"
      "+1ms LRW 0x1000 01 02 wkc=6\n");
  EXPECT_THAT(d.log->Only("hole"), ElementsAre("hole 62"));
  EXPECT_THAT(d.log->Only("forgotten"), IsEmpty());
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(GapBefore, SlavesInOpAreForgottenWhereTheWorkingCounterIsAnother) {
  const Decoded d = TwoThen(
      "+1ms BRD 0x0130 08 00\n+1ms LRW 0x1000 01 02 wkc=6 times=5\n+1ms LRW 0x1000 01 02 wkc=6 @missed times=3\n"
      "+1ms LRW 0x1000 01 02 wkc=3\n");
  EXPECT_THAT(d.log->Only("forgotten"), ElementsAre("forgotten 0", "forgotten 1"));
  EXPECT_EQ(d.Register(1, 0x0420), "?");
}

TEST(GapBefore, SlavesInOpAreForgottenWhereTheyShowAnotherState) {
  const Decoded d = TwoThen(
      "+1ms BRD 0x0130 08 00\n+1ms LRW 0x1000 01 02 wkc=6 times=5\n+1ms LRW 0x1000 01 02 wkc=6 @missed times=3\n"
      "+1ms FPRD 0x1001:0x0130 04 00\n");
  EXPECT_THAT(d.log->Only("forgotten"), ElementsAre("forgotten 0"));
  EXPECT_THAT(d.log->Only("state 0"), Contains("state 0 ? -> 0x0004"));  // nobody says that it changed
  EXPECT_EQ(d.Register(1, 0x0420), "0x03e8");
}

TEST(GapBefore, SlavesInOpThatAreSetUpAreForgotten) {
  const Decoded d = TwoThen(
      "+1ms BRD 0x0130 08 00\n+1ms LRW 0x1000 01 02 wkc=6 times=5\n+1ms LRW 0x1000 01 02 wkc=6 @missed times=3\n"
      "+1ms FPWR 0x1001:0x0120 01 00\n");
  EXPECT_THAT(d.log->Only("forgotten"), ElementsAre("forgotten 0"));
}

/// Two slaves in SAFEOP, whose process data go on after a gap of 3 ms.
constexpr std::string_view kSafeopBefore =
    "+1ms BRD 0x0130 04 00\n+1ms LRW 0x1000 01 02 wkc=6 times=5\n+1ms LRW 0x1000 01 02 wkc=6 @missed times=3\n";

TEST(GapBefore, SlavesInSafeopWhoseWorkingCounterGoesOnAreMappedAsBefore) {
  const Decoded d = TwoThen(std::string(kSafeopBefore) + "+1ms LRW 0x1000 01 02 wkc=6\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
  EXPECT_THAT(d.log->Only("forgotten"), ElementsAre("forgotten 0", "forgotten 1"));  // they may be in OP
}

TEST(GapBefore, SlavesInSafeopAreForgottenWhereTheWorkingCounterIsAnother) {
  const Decoded d = TwoThen(std::string(kSafeopBefore) + "+1ms LRW 0x1000 01 02 wkc=3\n");
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

TEST(GapBefore, SlavesInSafeopThatAreAskedForOpAreMappedAsBefore) {
  const Decoded d = TwoThen(std::string(kSafeopBefore) + "+1ms FPWR 0x1001:0x0120 08 00\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(GapBefore, SlavesInSafeopThatShowPreopAreForgotten) {
  const Decoded d = TwoThen(std::string(kSafeopBefore) + "+1ms FPRD 0x1001:0x0130 02 00\n");
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

TEST(GapBefore, SlavesInSafeopAreForgottenWhereItIsLong) {
  const Decoded d = TwoThen(
      "+1ms BRD 0x0130 04 00\n+1ms LRW 0x1000 01 02 wkc=6 times=5\n+300ms LRW 0x1000 01 02 wkc=6 @missed times=3\n"
      "+1ms LRW 0x1000 01 02 wkc=6\n");
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

/// What the controller is and can do does not change.
TEST(GapBefore, TheFeaturesOfTheControllerStayKnown) {
  const Decoded d = TwoThen(
      "+1ms FPRD 0x1001:0x0008 FC 02\n+1ms FPRD 0x1001:0x0130 02 00\n+1ms FPRD 0x1001:0x0130 02 00 @missed\n"
      "+1ms BRD 0x0000 11 00\n");
  EXPECT_THAT(d.log->Only("hole"), ElementsAre("hole 54"));
  EXPECT_EQ(d.Register(0, 0x0420), "?");
  EXPECT_EQ(d.Register(0, 0x0008), "0x02fc");
}

TEST(GapBefore, WhereItMayBeNothingIsForgotten) {
  const Decoded d = TwoThen("+1ms FPRD 0x1001:0x0130 02 00 idx=0\n+2s FPRD 0x1001:0x0130 02 00 idx=0\n");
  EXPECT_THAT(d.log->Only("silence"), ElementsAre("silence 52"));
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(GapBefore, IsNoneWhereTheNumbersGoOnAfterASilence) {
  const Decoded d = TwoThen("+1ms FPRD 0x1001:0x0130 02 00\n+2s FPRD 0x1001:0x0130 02 00\n");
  EXPECT_THAT(d.log->Only("silence"), IsEmpty());
}

}  // namespace
}  // namespace ecaudit::track::test
