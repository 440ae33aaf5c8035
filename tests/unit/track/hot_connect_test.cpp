// Slaves that join or leave a line at work: who is at a position then, and who keeps its address (esc-reference 3.3).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/track/event_log.h"

namespace ecaudit::track::test {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::string_view kThree = R"(
@slaves 3
+1ms BRD  0x0000   11 00
+1ms APWR 0:0x0010 01 10
+1ms APWR 1:0x0010 02 10
+1ms APWR 2:0x0010 03 10
+1ms FPRD 0x1001:0x0130 08 00
+1ms FPRD 0x1002:0x0130 08 00
+1ms FPRD 0x1003:0x0130 08 00
)";

Decoded Then(std::string_view text) {
  return Decode(std::string(kThree) + std::string(text));
}

std::string PlaceOf(const Decoded& d, StationAddress station) {
  const SlaveId id = d.slaves().AtStation(station);
  if (id == kNoSlave) return "nobody";
  const SlavePos* position = d.slaves()[id].position.if_known();
  return std::to_string(id) + " at " + (position != nullptr ? std::to_string(*position) : "?");
}

TEST(HotConnect, WhoIsNewInTheMiddleIsANewSlave) {
  const Decoded d = Then(R"(
@slaves 4
+1s  BRD  0x0130   09 00
+1ms APWR 1:0x0010 04 10
+1ms FPRD 0x1004:0x0130 01 00
+1ms FPRD 0x1001:0x0130 08 00
+1ms FPRD 0x1002:0x0130 08 00
+1ms FPRD 0x1003:0x0130 08 00
)");
  EXPECT_EQ(PlaceOf(d, 0x1001), "0 at 0");
  EXPECT_EQ(PlaceOf(d, 0x1002), "1 at 2");
  EXPECT_EQ(PlaceOf(d, 0x1003), "2 at 3");
  EXPECT_EQ(PlaceOf(d, 0x1004), "3 at 1");
  EXPECT_THAT(d.log->Only("address").back(), "address 3 = 0x1004");
  EXPECT_THAT(d.log->Only("forgotten"), IsEmpty());
  EXPECT_THAT(d.log->Only("state").back(), "state 3 ? -> 0x0001");
}

TEST(HotConnect, AGroupOfTwoInTheMiddle) {
  const Decoded d = Then(R"(
@slaves 5
+1s  BRD  0x0130   09 00
+1ms APWR 1:0x0010 04 10
+1ms APWR 2:0x0010 05 10
+1ms APRD 3:0x0130 08 00
)");
  EXPECT_EQ(PlaceOf(d, 0x1001), "0 at 0");
  EXPECT_EQ(PlaceOf(d, 0x1004), "3 at 1");
  EXPECT_EQ(PlaceOf(d, 0x1005), "4 at 2");
  EXPECT_EQ(PlaceOf(d, 0x1002), "1 at 3") << "slaves keep their order";
  EXPECT_EQ(PlaceOf(d, 0x1003), "2 at 4");
}

TEST(HotConnect, AfterAChangePositionsNameNoSlave) {
  // What is read at a position may come from anybody, and what is written there may be for anybody.
  const Decoded d = Then(R"(
@slaves 4
+1s  APRD 1:0x0130 01 00
+1ms APWR 1:0x0120 11 00
+1ms APRD 1:0x0130 01 00
+1ms APRD 3:0x0130 08 00
)");
  EXPECT_EQ(d.slaves().size(), 3U);
  EXPECT_EQ(d.log->Only("state").size(), 3U);
  EXPECT_THAT(d.log->Only("request"),
              ElementsAre("request 0 <- 0x0011 unknown", "request 1 <- 0x0011 unknown", "request 2 <- 0x0011 unknown"));
}

TEST(HotConnect, AnAddressReadByPositionShowsWhoIsThere) {
  const Decoded d = Then(R"(
@slaves 2
+1s  BRD  0x0130   08 00
+1ms APRD 1:0x0010 03 10
+1ms APRD 1:0x0130 02 00
)");
  EXPECT_EQ(PlaceOf(d, 0x1003), "2 at 1");
  EXPECT_EQ(d.log->Only("state").back(), "state 2 0x0008 -> 0x0002");
  EXPECT_EQ(PlaceOf(d, 0x1002), "1 at ?") << "it has left, as far as anything shows";
}

TEST(HotConnect, AnAliasReadByPositionShowsWhoIsThere) {
  const Decoded d = Decode(R"(
@slaves 2
+1ms BRD  0x0000   11 00
+1ms APWR 0:0x0010 01 10
+1ms APWR 1:0x0010 02 10
+1ms FPRD 0x1002:0x0012 07 00
@slaves 3
+1s  BRD  0x0130   08 00
+1ms APRD 2:0x0012 07 00
+1ms APRD 2:0x0130 04 00
)");
  EXPECT_EQ(PlaceOf(d, 0x1002), "1 at 2");
  EXPECT_EQ(d.log->Only("state").back(), "state 1 ? -> 0x0004");
}

TEST(HotConnect, OneThatLeftTheMiddleAndComesBackIsSetUpAgain) {
  const Decoded d = Then(R"(
+1ms FPWR 0x1002:0x0420 E8 03
@slaves 2
+1s  BRD  0x0130   08 00
+1ms FPRD 0x1001:0x0130 08 00
+1ms FPRD 0x1003:0x0130 08 00
@slaves 3
+1s  BRD  0x0130   09 00
+1ms APWR 1:0x0010 02 10
+1ms FPRD 0x1002:0x0130 01 00
)");
  EXPECT_EQ(d.slaves().size(), 3U);
  EXPECT_EQ(PlaceOf(d, 0x1002), "1 at 1");
  EXPECT_EQ(d.Register(1, 0x0420), "?") << "it may have been without power";
  EXPECT_THAT(d.log->Only("forgotten"), Each("forgotten 1"));
  EXPECT_EQ(d.log->Only("state").back(), "state 1 ? -> 0x0001");
}

TEST(HotConnect, WhoAnswersAllTheWhileWasNotAway) {
  // A branch in the middle comes back: the slave behind it was there, although the number of slaves was less.
  const Decoded d = Then(R"(
+1ms FPWR 0x1003:0x0420 E8 03
@slaves 2
+1s  BRD  0x0130   08 00
+1ms FPRD 0x1003:0x0130 08 00
+1ms BWR  0x0422   05 00
@slaves 3
+1s  BRD  0x0130   09 00
)");
  EXPECT_EQ(d.Register(2, 0x0420), "0x03e8");
  EXPECT_EQ(d.Register(2, 0x0422), "0x0005");
  EXPECT_THAT(d.log->Only("forgotten"), Not(Contains("forgotten 2")));
}

TEST(HotConnect, AllThatAnswerAgainAreWhereTheyWere) {
  const Decoded d = Then(R"(
@slaves 1
+1s  BRD  0x0130   08 00
@slaves 3
+1s  BRD  0x0130   08 00
+1ms FPRD 0x1001:0x0130 08 00
+1ms FPRD 0x1002:0x0130 08 00
+1ms FPRD 0x1003:0x0130 08 00
+1ms APRD 2:0x0130 04 00
)");
  EXPECT_EQ(d.log->Only("state").back(), "state 2 0x0008 -> 0x0004");
}

TEST(HotConnect, ANumberThatOneFrameShowsChangesNothing) {
  // The return of another frame, where packets are missing: nobody joins and leaves within milliseconds.
  const Decoded d = Then(R"(
@slaves 5
+1ms BRD  0x0130   08 00
@slaves 3
+1ms BRD  0x0130   08 00
+1ms APRD 2:0x0130 04 00
)");
  EXPECT_EQ(d.log->Only("state").back(), "state 2 0x0008 -> 0x0004");
}

TEST(HotConnect, ClearedAddressesBeginAgain) {
  const Decoded d = Then(R"(
+1ms FPWR 0x1002:0x0420 E8 03
@slaves 4
+1s  BRD  0x0130   09 00
+1ms BWR  0x0010   00 00
+1ms APWR 0:0x0010 01 10
+1ms APWR 1:0x0010 02 10
+1ms APWR 2:0x0010 03 10
+1ms APWR 3:0x0010 04 10
+1ms APRD 3:0x0130 01 00
)");
  EXPECT_EQ(d.slaves().size(), 4U);
  EXPECT_EQ(PlaceOf(d, 0x1002), "1 at 1");
  EXPECT_EQ(PlaceOf(d, 0x1004), "3 at 3");
  EXPECT_EQ(d.Register(1, 0x0420), "?") << "another may be there";
  for (const std::string& line : d.log->Only("address")) EXPECT_EQ(line.find(" as "), std::string::npos) << line;
}

}  // namespace
}  // namespace ecaudit::track::test
