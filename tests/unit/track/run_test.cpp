// Several runs of a bus, or several recordings, in one file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/track/event_log.h"

namespace ecaudit::track::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A start-up of one slave to `state`: eight packets.
std::string StartUp(std::string_view state) {
  return "+1ms BWR 0x0120 11 00\n+1ms BWR 0x0010 00 00\n+1ms APWR 0:0x0010 01 10\n+1ms FPWR 0x1001:0x0120 " +
         std::string(state) + " 00\n+1ms FPRD 0x1001:0x0130 " + std::string(state) + " 00\n";
}

TEST(Run, TheFirstOneIsNoOther) {
  EXPECT_THAT(Decode(StartUp("02")).log->Only("run"), IsEmpty());
}

TEST(Run, ARestartBeginsOne) {
  EXPECT_THAT(Decode(StartUp("02") + StartUp("04") + StartUp("02")).log->Only("run"),
              ElementsAre("run 11 (set up)", "run 21 (set up)"));
}

TEST(Run, ScanningAgainBeforeAnySlaveHasLeftInitIsNone) {
  EXPECT_THAT(Decode(StartUp("01") + StartUp("01") + StartUp("02")).log->Only("run"), IsEmpty());
}

TEST(Run, ARestartOfABusThatWasRunningWhenTheCaptureBeganIsOne) {
  EXPECT_THAT(Decode("+1ms FPRD 0x1001:0x0130 08 00\n" + StartUp("02")).log->Only("run"),
              ElementsAre("run 3 (set up)"));
}

TEST(Run, WhatNoSlaveTookBeginsNone) {
  EXPECT_THAT(Decode(StartUp("02") + "+1ms BWR 0x0120 11 00 wkc=0\n").log->Only("run"), IsEmpty());
}

/// The packets of `text` again, so much later.
Decoded Again(std::string_view text, std::string_view behind, std::int64_t later) {
  Result<Trace> first = Trace::Parse(text);
  Result<Trace> second = Trace::Parse(behind);
  EXPECT_TRUE(first && second);
  std::vector<Packet> packets = first->Packets();
  std::vector<Packet> more = second->Packets();
  const TimeNs shift = packets.back().time - more.front().time + later;
  for (Packet& packet : more) {
    packet.time += shift;
    packets.push_back(packet);
  }
  return Decode(packets);
}

constexpr std::int64_t kYear = 31'536'000'000'000'000;

TEST(Run, AJumpOfTheClockBeginsOneAndNothingIsCarriedOver) {
  for (const std::int64_t later : {kYear, -kYear, std::int64_t{-5'000'000'000}}) {
    const Decoded d =
        Again(StartUp("02") + "+1ms FPWR 0x1001:0x0420 E8 03 idx=9\n", "+1ms LRW 0x1000 01 02 idx=40 times=3\n", later);
    EXPECT_THAT(d.log->Only("run"), ElementsAre("run 13 (clock)")) << later;
    EXPECT_THAT(d.log->Only("hole"), ElementsAre("hole 13")) << later;
    EXPECT_EQ(d.Register(0, 0x0420), "?") << later;
    const PipelineStatistics& statistics = d.pipeline->statistics();
    EXPECT_EQ(statistics.clock_jumps, 1U);
    EXPECT_LT(statistics.elapsed_ns, 1'000'000'000);
    EXPECT_GT(statistics.elapsed_ns, 0);
  }
}

TEST(Run, AClockThatIsSetWhileTheFramesGoOnIsNone) {
  std::string numbered;
  for (int i = 0; i < 40; ++i) numbered += "+1ms FPRD 0x1001:0x0130 02 00 idx=" + std::to_string(i) + "\n";
  std::string on;
  for (int i = 40; i < 60; ++i) on += "+1ms FPRD 0x1001:0x0130 02 00 idx=" + std::to_string(i) + "\n";
  const Decoded d = Again(numbered, on, -kYear);
  EXPECT_THAT(d.log->Only("run"), IsEmpty());
  EXPECT_THAT(d.log->Only("forgotten"), IsEmpty());
}

}  // namespace
}  // namespace ecaudit::track::test
