#include "decoder/bus/pairing.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Pairing, OneAfterTheOther) {
  const Paired result = PairUp(R"(
+0us BRD 0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPWR 0x1001:0x0120 02 00 & FPRD 0x1001:0x0130 01 00
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "3+4", "5+6"));
  EXPECT_THAT(result.log.sent, ElementsAre(5)) << "what only reads is not told before it comes back";
  EXPECT_EQ(result.statistics.outbound, 3U);
  EXPECT_EQ(result.statistics.returned, 3U);
  EXPECT_EQ(result.statistics.paired, 3U);
}

TEST(Pairing, SeveralFramesInFlight) {
  const Paired result = PairUp(R"(
@rtt 5ms
+0us LRW 0x1000 01 02 idx=1
+1ms LRW 0x2000 01 02 idx=1
+1ms LRW 0x1000 01 02 idx=2
+1ms FPRD 0x1001:0x0130 01 00 idx=3
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+5", "2+6", "3+7", "4+8"));
}

TEST(Pairing, EqualFramesInFlightComeBackInOrder) {
  // TwinCAT scans with index 0xFF for every frame.
  const Paired result = PairUp(R"(
@rtt 5ms
+0us FPRD 0x1001:0x0130 01 00 idx=0xFF
+1ms FPRD 0x1001:0x0130 02 00 idx=0xFF
+1ms FPRD 0x1001:0x0130 04 00 idx=0xFF
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+4", "2+5", "3+6"));
}

TEST(Pairing, MidRunBeginsWithAReturn) {
  const Paired result = PairUp(R"(
+0us LRW 0x1000 01 02 idx=4 @returned-only
+1ms LRW 0x1000 01 02 idx=5
+1ms LRW 0x1000 01 02 idx=6
)");
  EXPECT_THAT(result.log.words, ElementsAre("+1", "2+3", "4+5"));
  EXPECT_EQ(result.statistics.unmatched_returned, 1U);
}

TEST(Pairing, EqualTimeStamps) {
  const Paired result = PairUp(R"(
@rtt 0us
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00 @lost
+1ms FPRD 0x1001:0x0130 01 00
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "3+4", "6+7", "lost 5"));
  EXPECT_EQ(result.statistics.identical_stamps, 3U);
}

TEST(Pairing, NoTimeStamps) {
  const Paired result = PairUp(R"(
@no-time
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00 @lost
+1ms FPRD 0x1001:0x0130 01 00
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "4+5", "lost 3"));
  EXPECT_EQ(result.statistics.identical_stamps, 0U);
}

TEST(Pairing, LostFramesAreNamed) {
  Trace trace;
  for (int i = 0; i < 200; ++i) {
    auto& frame = trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i % 16));
    if (i == 20 || i == 60 || i == 61) frame.Lost().Mark(std::to_string(i));
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.lost, 3U);
  EXPECT_THAT(result.log.Only("lost"),
              ElementsAre("lost " + std::to_string(trace.Sent("20")), "lost " + std::to_string(trace.Sent("60")),
                          "lost " + std::to_string(trace.Sent("61"))));
  EXPECT_EQ(result.statistics.paired, 197U);
}

TEST(Pairing, IndexReusedAfterATimeOut) {
  // The master gave up and uses index 3 for something else; the first never comes.
  const Paired result = PairUp(R"(
+0us FPRD 0x1001:0x0130 01 00 idx=1
+1ms FPRD 0x1001:0x0130 01 00 idx=3 @lost
+4ms FPWR 0x1001:0x0120 02 00 idx=3
+1ms FPRD 0x1001:0x0130 01 00 idx=4
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "4+5", "6+7", "lost 3"));
}

TEST(Pairing, RetryFirstCopyLost) {
  // SOEM repeats the identical frame after 2 ms; round trips are 30 us.
  const Paired result = PairUp(R"(
+0us  FPRD 0x1001:0x0130 01 00 idx=1
+1ms  FPRD 0x1001:0x0130 01 00 idx=2 @lost
+2ms  FPRD 0x1001:0x0130 01 00 idx=2
+1ms  FPRD 0x1001:0x0130 01 00 idx=3
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "4+5", "6+7", "lost 3"));
}

TEST(Pairing, RetrySecondCopyLost) {
  // The first was only late: it comes back 5 us after the second was sent.
  const Paired result = PairUp(R"(
+0us    FPRD 0x1001:0x0130 01 00 idx=1
+1ms    FPRD 0x1001:0x0130 01 00 idx=2 rtt=2005us
+2ms    FPRD 0x1001:0x0130 01 00 idx=2 @lost
+1ms    FPRD 0x1001:0x0130 01 00 idx=3
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "3+5", "6+7", "lost 4"));
}

TEST(Pairing, RetryAndBothComeBack) {
  const Paired result = PairUp(R"(
+0us    FPRD 0x1001:0x0130 01 00 idx=1
+1ms    FPRD 0x1001:0x0130 01 00 idx=2 rtt=2010us
+2ms    FPRD 0x1001:0x0130 01 00 idx=2 rtt=30us
+1ms    FPRD 0x1001:0x0130 01 00 idx=3
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "3+5", "4+6", "7+8"));
  EXPECT_EQ(result.statistics.duplicated, 0U);
}

TEST(Pairing, RetryWithoutUsableStampsCountsOneLoss) {
  for (const char* stamps : {"@no-time\n", "@resolution 10ms\n"}) {
    const Paired result = PairUp(std::string(stamps) + R"(
+0us  FPRD 0x1001:0x0130 01 00 idx=1
+1ms  FPRD 0x1001:0x0130 01 00 idx=2 @lost
+2ms  FPRD 0x1001:0x0130 01 00 idx=2
+1ms  FPRD 0x1001:0x0130 01 00 idx=3
+1ms  FPRD 0x1001:0x0130 01 00 idx=4
)");
    EXPECT_EQ(result.statistics.lost, 1U) << stamps;
    EXPECT_EQ(result.statistics.paired, 4U) << stamps;
    EXPECT_EQ(result.statistics.duplicated, 0U) << stamps;
  }
}

TEST(Pairing, LateReturnIsNotLost) {
  const Paired result = PairUp(R"(
+0us LRW 0x1000 01 02 idx=1 rtt=2500us
+1ms LRW 0x1000 01 02 idx=2
+1ms LRW 0x1000 01 02 idx=3
+1ms LRW 0x1000 01 02 idx=4
)");
  EXPECT_THAT(result.log.words, ElementsAre("2+3", "4+5", "1+6", "7+8"));
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(Pairing, SwappedReturns) {
  const Paired result = PairUp(R"(
+0us LRW 0x1000 01 02 idx=1 rtt=90us
+20us LRW 0x1000 01 02 idx=2 rtt=30us
+1ms LRW 0x1000 01 02 idx=3
)");
  EXPECT_THAT(result.log.words, ElementsAre("2+3", "1+4", "5+6"));
}

TEST(Pairing, Duplicates) {
  const Paired result = PairUp(R"(
+0us LRW 0x1000 01 02 idx=1 @twice
+1ms LRW 0x1000 01 02 idx=2
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "dup 3 of 2", "4+5"));
  EXPECT_EQ(result.statistics.duplicated, 1U);
}

TEST(Pairing, WhatWasDroppedByTheCaptureIsNoDuplicate) {
  // The outbound copy of the third frame with index 1 is not in the file. Its return equals those before, as indices
  // repeat and nothing moves.
  Trace trace;
  for (int i = 0; i < 64; ++i) {
    auto& frame = trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i % 16));
    if (i == 33) frame.ReturnedOnly();
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.duplicated, 0U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.unmatched_returned, 1U);

  // The same with a master that has only one index, polling once a second.
  Trace slow;
  for (int i = 0; i < 8; ++i) {
    auto& frame = slow.After(1'000'000).Fprd(0x1001, 0x0130, {8, 0}).Index(0xFF);
    if (i == 4) frame.ReturnedOnly();
  }
  const Paired polled = PairUp(slow);
  EXPECT_EQ(polled.statistics.duplicated, 0U);
  EXPECT_EQ(polled.statistics.lost, 0U);
}

/// Packets of `trace` with those of `twice` (numbers from 1) there twice, `apart` ns later.
std::vector<Packet> CapturedTwice(const Trace& trace, const std::vector<std::size_t>& twice, std::int64_t apart) {
  std::vector<Packet> out;
  const std::vector<Packet> packets = trace.Packets();
  for (std::size_t i = 0; i < packets.size(); ++i) {
    out.push_back(packets[i]);
    if (std::find(twice.begin(), twice.end(), i + 1) == twice.end()) continue;
    out.push_back(packets[i]);
    out.back().time += apart;
  }
  return out;
}

TEST(Pairing, OutboundFrameCapturedTwiceIsNoLoss) {
  Trace trace;
  for (int i = 0; i < 80; ++i) trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(7);
  const Paired result = PairUp(CapturedTwice(trace, {3, 159}, 500));
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.paired, 80U);
  EXPECT_EQ(result.statistics.outbound_twice, 1U);
  EXPECT_EQ(result.statistics.in_flight, 1U);
  EXPECT_THAT(result.log.doubtful, IsEmpty());
  // A master that repeats a frame a while later, without hearing anything, has lost one.
  EXPECT_EQ(PairUp(CapturedTwice(trace, {3}, 2'000'000)).statistics.lost, 1U);
}

TEST(Pairing, EveryPacketCapturedTwice) {
  Trace trace;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < 40; ++i) {
    trace.After(1000).Fprd(0x1001, 0x0130, {8, 0}).Index(static_cast<std::uint8_t>(i));
    if (i == 0) continue;  // the first pair shows that the stamps are good enough to tell
    all.push_back(2 * i + 1);
    all.push_back(2 * i + 2);
  }
  const Paired result = PairUp(CapturedTwice(trace, all, 300));
  EXPECT_EQ(result.statistics.paired, 40U);
  EXPECT_EQ(result.statistics.captured_twice, 39U);
  EXPECT_EQ(result.statistics.duplicated, 0U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.log.words.size(), 40U);
}

TEST(Pairing, FramesWhoseEndIsOpenAreDoubtedBeforeWhatOvertookThem) {
  const Paired result = PairUp(R"(
+0us FPRD 0x1001:0x0130 01 00 idx=1
+1ms FPWR 0x1001:0x0810 01 00 idx=2 @lost
+1ms FPWR 0x1001:0x0120 04 00 idx=3
+1ms FPRD 0x1001:0x0130 04 00 idx=4
)");
  EXPECT_THAT(result.log.doubtful, ElementsAre(3));
  EXPECT_THAT(result.log.before_doubt, ElementsAre("1+2"));
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "4+5", "6+7", "lost 3"));
}

TEST(Pairing, ReturnsAfterTheFirstPairWithoutOutboundCopyAreMissedByTheCapture) {
  const Paired result = PairUp(R"(
+0us LRW 0x1000 01 02 idx=4 @returned-only
+1ms LRW 0x1000 01 02 idx=5
+1ms LRW 0x1000 01 02 idx=6 @returned-only
+1ms LRW 0x1000 01 02 idx=7
)");
  EXPECT_EQ(result.statistics.unmatched_returned, 2U);
  EXPECT_EQ(result.statistics.missed_outbound, 1U);
}

TEST(Pairing, WhatWasInFlightWhereTwoCapturesWerePutTogetherIsUndecided) {
  Trace first;
  for (int i = 0; i < 4; ++i) first.After(1000).Fprd(0x1001, 0x0130, {8, 0}).Index(static_cast<std::uint8_t>(i));
  std::vector<Packet> packets = first.Packets();
  const std::vector<Packet> second = packets;
  packets.pop_back();
  for (Packet packet : second) {
    packet.time -= 2'000'000'000;
    packets.push_back(packet);
  }
  const Paired result = PairUp(packets);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.frames().undecided_total(), 1U);
}

/// A frame, its return with one byte changed at `offset`, and two healthy frames behind.
Paired WithFlippedBit(std::size_t offset, unsigned bit) {
  Trace trace;
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0});
  trace.After(1000).Fpwr(0x1001, 0x0800, Bytes(8, 0x55)).Mark("hit");
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0});
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0});
  std::vector<Packet> packets = trace.Packets();
  std::uint8_t& byte = packets[trace.Returned("hit") - 1].bytes[offset];
  byte = static_cast<std::uint8_t>(byte ^ 1U << bit);
  return PairUp(packets);
}

TEST(Pairing, OneFlippedBitInAReturnIsNoLoss) {
  // Everything from the EtherCAT header to the working counter (offsets 14 to 35), any bit.
  for (std::size_t offset = 14; offset < 16 + 20; ++offset) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (offset == 15 && bit >= 4) continue;  // another EtherCAT type: nobody can know that it was a return
      const Paired result = WithFlippedBit(offset, bit);
      EXPECT_EQ(result.statistics.lost, 0U) << offset << "." << bit;
      EXPECT_EQ(result.statistics.duplicated, 0U) << offset << "." << bit;
      EXPECT_EQ(result.statistics.paired + result.statistics.frames().undecided_total(), 4U) << offset << "." << bit;
    }
  }
}

TEST(Pairing, AnIndexUsedAgainDoesNotAnswerWhatWasLostLongAgo) {
  // Sixteen indices. A write is lost; the outbound copy of a later one with the same index is not in the capture.
  Trace trace;
  for (unsigned i = 0; i < 60; ++i) {
    const auto index = static_cast<std::uint8_t>(i % 16);
    if (i == 4 || i == 20) {
      auto& frame = trace.After(1000).Fpwr(0x1001, 0x1800, Bytes(8, static_cast<std::uint8_t>(i))).Index(index);
      i == 4 ? frame.Lost() : frame.ReturnedOnly();
    } else {
      trace.After(1000).Fprd(0x1001, 0x0130, {8, 0}).Index(index);
    }
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.altered, 0U);
  EXPECT_EQ(result.statistics.lost, 1U);
  EXPECT_EQ(result.statistics.missed_outbound, 1U);
}

/// The capture misses the return of one frame and the outbound copy of the next, whose index differs in one bit.
TEST(Pairing, ReturnOfTheNextFrameIsNotTheFrameBeforeWithAFlippedBit) {
  for (const std::string frames : {"20", "21"}) {
    const Paired result =
        PairUp("+1ms FPRD 0x1001:0x0130 08 00 times=" + frames +
               "\n+1ms FPRD 0x1001:0x0130 08 00 @lost\n"
               "+1ms FPRD 0x1001:0x0130 08 00 @returned-only\n+1ms FPRD 0x1001:0x0130 08 00 times=9\n");
    EXPECT_EQ(result.statistics.altered, 0U) << frames;
    EXPECT_EQ(result.statistics.missed_outbound, 1U) << frames;
  }
}

TEST(Pairing, AlteredReturnsAreNotFedOn) {
  EXPECT_THAT(WithFlippedBit(17, 3).log.words, Contains("altered 4")) << "index";
  EXPECT_THAT(WithFlippedBit(18, 0).log.words, Contains("altered 4")) << "station address";
  EXPECT_THAT(WithFlippedBit(20, 3).log.words, Contains("altered 4")) << "register";
  EXPECT_THAT(WithFlippedBit(30, 7).log.words, Contains("altered 4")) << "written data";
  EXPECT_THAT(WithFlippedBit(22, 2).log.words, Contains("malformed 4")) << "length";
}

TEST(Pairing, OutboundMalformedFramesWaitForNothing) {
  Trace trace;
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0});
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0}).Mark("bad");
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0});
  std::vector<Packet> packets = trace.Packets();
  packets[2].bytes[22] = 0x60;
  packets.erase(packets.begin() + 3);
  const Paired result = PairUp(packets);
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "malformed 3", "4+5"));
}

TEST(Pairing, StillInFlightAtTheEnd) {
  const Paired result = PairUp(R"(
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00 @lost
)");
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "3+4"));
  EXPECT_EQ(result.statistics.in_flight, 1U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(Pairing, OvertakenOnceBeforeTheEndIsLost) {
  const Paired result = PairUp(R"(
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00 @lost
+1ms FPRD 0x1001:0x0130 01 00
)");
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 3"));
}

Trace SilentFor(int frames, std::int64_t cycle_us) {
  Trace trace;
  for (int i = 0; i < 50; ++i) trace.After(cycle_us).Lrw(0x1000, Bytes(4, 0), Bytes(4, 1));
  for (int i = 0; i < frames; ++i) trace.After(cycle_us).Lrw(0x1000, Bytes(4, 0), Bytes(4, 1)).Lost();
  return trace;
}

TEST(Pairing, SilenceAtTheEnd) {
  // The cable breaks 0.2 s before the capture ends: frames older than 50 ms and 100 round trips cannot be under way.
  const Paired result = PairUp(SilentFor(200, 1000));
  EXPECT_THAT(result.log.Only("lost"), IsEmpty());
  EXPECT_EQ(result.log.Only("silent").size(), 149U);
  EXPECT_EQ(result.log.Only("silent").front(), "silent 101");
  EXPECT_EQ(result.statistics.in_flight, 51U);
}

TEST(Pairing, SilenceLongerThanTheRing) {
  const Paired result = PairUp(SilentFor(600, 1000));
  EXPECT_EQ(result.statistics.lost, 549U);
  EXPECT_EQ(result.log.Only("silent").size(), 549U);
  EXPECT_EQ(result.statistics.lost + result.statistics.in_flight, 600U);
}

TEST(Pairing, ShortSilenceAtTheEndProvesNothing) {
  EXPECT_EQ(PairUp(SilentFor(40, 1000)).statistics.lost, 0U) << "40 ms";
  EXPECT_EQ(PairUp(SilentFor(2, 100'000)).statistics.lost, 0U) << "two frames";
}

TEST(Pairing, SilenceAtTheEndWithoutTimeStamps) {
  Trace trace;
  trace.NoTime();
  for (int i = 0; i < 10; ++i) trace.After(1000).Lrw(0x1000, Bytes(4, 0), Bytes(4, 1));
  for (int i = 0; i < 100; ++i) trace.After(1000).Lrw(0x1000, Bytes(4, 0), Bytes(4, 1)).Lost();
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.lost, 36U) << "those with 64 behind them";
}

TEST(Pairing, SilenceInTheMiddle) {
  Trace trace = SilentFor(100, 1000);
  for (int i = 0; i < 50; ++i) trace.After(1000).Lrw(0x1000, Bytes(4, 0), Bytes(4, 1));
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.lost, 100U);
  EXPECT_EQ(result.log.Only("lost").size(), 100U);
}

TEST(Pairing, ForeignPacketAfterALostFrameIsNoted) {
  const Paired result = PairUp(R"(
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00 @lost
+1us OTHER
+1ms FPRD 0x1001:0x0130 01 00 @lost
+1ms FPRD 0x1001:0x0130 01 00
+1ms OTHER
)");
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 3!", "lost 5"));
}

TEST(Pairing, FramesOfAnotherMasterOvertakeNothing) {
  // Two buses in one file: a slow answer on one is no loss because the other is quick.
  Trace trace;
  for (int i = 0; i < 4; ++i) {
    trace.Mac({0x01, 0x01, 0x01, 0x01, 0x01, 0x01});
    trace.After(1000).Fprd(0x1001, 0x0130, {1, 0}).Rtt(900'000);
    trace.Mac({0x10, 0x10, 0x10, 0x10, 0x10, 0x10});
    for (int k = 0; k < 80; ++k) trace.After(10).Lrw(0, Bytes(4, 0), Bytes(4, 0)).Rtt(5000);
  }
  trace.Mac({0x01, 0x01, 0x01, 0x01, 0x01, 0x01});
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0}).Lost();  // under way when the capture ends
  trace.Mac({0x10, 0x10, 0x10, 0x10, 0x10, 0x10});
  trace.After(10).Lrw(0, Bytes(4, 0), Bytes(4, 0)).Rtt(5000);
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.paired, 4U * 81U + 1U);
  EXPECT_EQ(result.statistics.in_flight, 1U);
}

// --- two interfaces -------------------------------------------------------------------------------------------------

constexpr std::string_view kTwoInterfaces = R"(
@two-interfaces
+0us FPRD 0x1001:0x0130 01 00 %s
+1ms FPRD 0x1001:0x0130 01 00 %s
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
)";

std::string With(std::string_view first, std::string_view second) {
  std::string text(kTwoInterfaces);
  text.replace(text.find("%s"), 2, first);
  text.replace(text.find("%s"), 2, second);
  return text;
}

TEST(Pairing, TheInterfaceOfTheReturnsStartsLater) {
  const Paired result = PairUp(With("@lost", "@lost"));
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.frames().undecided_total(), 2U);
  EXPECT_THAT(result.log.words, ElementsAre("3+4", "5+6", "undecided 1", "undecided 2"));
}

TEST(Pairing, TheInterfaceOfTheReturnsStartsEarlier) {
  const Paired result = PairUp(With("@returned-only", "@returned-only"));
  EXPECT_EQ(result.statistics.unmatched_returned, 2U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(Pairing, LossesInTheMiddleOfTwoInterfacesCount) {
  const Paired result = PairUp(With("", "@lost"));
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 3"));
}

TEST(Pairing, TheInterfaceOfTheReturnsStopsEarlier) {
  Trace trace = *Trace::Parse("@two-interfaces\n+0us BRD 0x0130 01 00\n+1ms BRD 0x0130 01 00\n");
  for (int i = 0; i < 100; ++i) trace.After(10'000).Lrw(0, Bytes(4, 0), Bytes(4, 0)).Lost();
  EXPECT_EQ(PairUp(trace).statistics.lost, 0U);
}

TEST(Pairing, ReturnWrittenBeforeItsOutboundCopy) {
  Trace trace = *Trace::Parse(R"(
@two-interfaces
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
)");
  std::vector<Packet> packets = trace.Packets();
  std::swap(packets[2], packets[3]);
  const Paired result = PairUp(packets);
  EXPECT_EQ(result.statistics.paired, 3U);
  EXPECT_EQ(result.statistics.unmatched_returned, 0U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "+3", "5+6"));
}

TEST(Pairing, ReturnWrittenBeforeItsOutboundCopyOnOneInterface) {
  // Receive queues of one interface; only time stamps that say so make them a pair.
  const Trace trace = *Trace::Parse(R"(
+0us FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
)");
  std::vector<Packet> packets = trace.Packets();
  std::swap(packets[2], packets[3]);
  const Paired result = PairUp(packets);
  EXPECT_EQ(result.statistics.paired, 3U);
  EXPECT_EQ(result.statistics.unmatched_returned, 0U);
  EXPECT_EQ(result.statistics.missed_outbound, 0U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

// --- snap length ----------------------------------------------------------------------------------------------------

Trace TwoDatagramsEach(std::size_t cut) {
  Trace trace;
  for (int i = 0; i < 40; ++i) {
    auto& frame = trace.After(1000).Lrw(0x1000, Bytes(20, 0), Bytes(20, 1)).Fprd(0x1001, 0x0130, {8, 0});
    if (cut != 0) frame.Cut(cut);
    if (i == 20) frame.Lost().Mark("lost");
  }
  return trace;
}

TEST(Pairing, AnySnapLength) {
  // First datagram: 16 to 48, second: to 62.
  for (std::size_t cut = 1; cut < 62; ++cut) {
    const Trace trace = TwoDatagramsEach(cut);
    const Paired result = PairUp(trace);
    if (cut < 14) {
      EXPECT_EQ(result.statistics.outbound, 0U) << cut;
    } else {
      EXPECT_EQ(result.statistics.outbound, 40U) << cut;
      EXPECT_EQ(result.statistics.paired, 39U) << cut;
      EXPECT_EQ(result.statistics.duplicated, 0U) << cut;
      // Without a readable datagram it cannot be told which one, but that one is missing still shows.
      EXPECT_LE(result.statistics.lost, 1U) << cut;
      if (cut >= 48) {
        EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost " + std::to_string(trace.Sent("lost"))));
      }
    }
  }
}

TEST(Pairing, CopiesThatWereCutDifferently) {
  for (std::size_t cut = 1; cut < 62; ++cut) {
    for (const bool outbound : {false, true}) {
      Trace trace;
      for (int i = 0; i < 40; ++i) {
        trace.After(1000).Lrw(0x1000, Bytes(20, 0), Bytes(20, 1)).Fprd(0x1001, 0x0130, {8, 0});
      }
      std::vector<Packet> packets = trace.Packets();
      Packet& packet = packets[outbound ? 40 : 41];
      packet.original_length = static_cast<std::uint32_t>(packet.bytes.size());
      packet.bytes.resize(cut);
      const Paired result = PairUp(packets);
      EXPECT_EQ(result.statistics.lost, 0U) << cut << outbound;
      EXPECT_EQ(result.statistics.altered, 0U) << cut << outbound;
      EXPECT_EQ(result.statistics.duplicated, 0U) << cut << outbound;
    }
  }
}

// --- bounds ---------------------------------------------------------------------------------------------------------

TEST(Pairing, HugePacketsArePairedToo) {
  Trace trace;
  trace.After(1000).Lrw(0, Bytes(1486, 0), Bytes(1486, 1));
  trace.After(1000).Lrw(0, Bytes(1486, 0), Bytes(1486, 1));
  std::vector<Packet> packets = trace.Packets();
  for (Packet& packet : packets) packet.bytes.resize(200'000, 0xEE);
  const Paired result = PairUp(packets);
  EXPECT_THAT(result.log.words, ElementsAre("1+2", "3+4"));
}

TEST(Pairing, TimeStampsFromTheEndsOfTime) {
  Trace trace;
  for (int i = 0; i < 40; ++i) trace.After(1000).Fprd(0x1001, 0x0130, {1, 0}).Index(1);
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0}).Index(1).Lost();
  std::vector<Packet> packets = trace.Packets();
  for (std::size_t i = 0; i < packets.size(); ++i) {
    packets[i].time = i % 3 == 0 ? std::numeric_limits<TimeNs>::min() : std::numeric_limits<TimeNs>::max();
  }
  const Paired result = PairUp(packets);
  EXPECT_EQ(result.statistics.paired, 40U);
}

/// `count` polls a millisecond apart, numbered modulo `round` from `first` on, as lines of a trace.
std::string Numbered(int count, int first, int round) {
  std::string lines;
  for (int i = 0; i < count; ++i) {
    lines += "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string((first + i) % round) + "\n";
  }
  return lines;
}

TEST(PairingGap, WhatWasInFlightWhereIndicesSkipIsUndecided) {
  const Paired result = PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @lost\n" +
                               "+6ms FPRD 0x1001:0x0130 08 00 idx=14\n" + Numbered(60, 15, 16));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole 82+83"));
  EXPECT_THAT(result.log.Only("lost"), IsEmpty());
  EXPECT_THAT(result.log.Only("undecided"), ElementsAre("undecided 81"));
  EXPECT_EQ(result.statistics.gaps, 1U);
  EXPECT_EQ(result.statistics.first_gap.number, 82U);
}

TEST(PairingGap, SkippedIndicesAreNoCertainGapWhereBothCopiesOfAllFramesAreThere) {
  const Paired result = PairUp(Numbered(40, 0, 256) + Numbered(40, 43, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("skip 81+82"));
  EXPECT_EQ(result.statistics.gaps, 0U);
  EXPECT_EQ(result.statistics.skips, 0U);  // three more frames need 4 ms at this rate, 1 ms passed
}

TEST(PairingGap, SkippedIndicesCountWhereTheSenderHadTheTimeForThem) {
  const std::string later = "+2ms FPRD 0x1001:0x0130 08 00 idx=41\n";
  const Paired result = PairUp(Numbered(40, 0, 256) + later + Numbered(40, 42, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("likely skip 81+82"));
  EXPECT_EQ(result.statistics.skips, 1U);
  EXPECT_EQ(result.statistics.first_skip.number, 81U);
}

TEST(PairingGap, SkippedIndicesAreAGapWhereACopyWasMissingBefore) {
  const Paired result = PairUp(Numbered(20, 0, 256) + "+1ms FPRD 0x1001:0x0130 08 00 idx=20 @returned-only\n" +
                               Numbered(20, 21, 256) + Numbered(40, 44, 256));
  EXPECT_THAT(result.log.gaps, Contains("hole 82+83"));
}

TEST(PairingGap, WhereIndicesGoOnTheFrameIsLostHoweverLongTheMasterWaited) {
  const Paired result = PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @lost\n" +
                               "+6ms FPRD 0x1001:0x0130 08 00 idx=9\n" + Numbered(60, 10, 16));
  EXPECT_THAT(result.log.gaps, IsEmpty());
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 81"));
}

TEST(PairingGap, ARepeatedFrameIsALossHoweverLateItIsRepeated) {
  for (const char* pause : {"700us", "2ms", "5ms", "6ms", "19ms"}) {
    for (const int round : {16, 256, 1}) {
      const Paired result = PairUp(
          Numbered(40, 0, round) + "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(40 % round) + " @lost\n+" +
          pause + " FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(40 % round) + "\n" + Numbered(60, 41, round));
      EXPECT_THAT(result.log.gaps, IsEmpty()) << pause << " " << round;
      EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 81")) << pause << " " << round;
      EXPECT_EQ(result.statistics.repeated_unanswered, 1U);
    }
  }
}

TEST(PairingGap, ARepeatedFrameIsNoGap) {
  // SOEM sends the same frame with the same index again when its return is late.
  const Paired result = PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @lost\n" +
                               "+2ms FPRD 0x1001:0x0130 08 00 idx=8\n" + Numbered(60, 9, 16));
  EXPECT_THAT(result.log.gaps, IsEmpty());
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 81"));
}

TEST(PairingGap, SixteenIndicesComeRoundInALongSilence) {
  // Two rounds of 16 frames may be missing here. But all frames are matched, and the index is the next one.
  const Paired result = PairUp(Numbered(100, 0, 16) + "+32ms FPRD 0x1001:0x0130 08 00 idx=4\n" + Numbered(60, 5, 16));
  EXPECT_THAT(result.log.gaps, ElementsAre("rounds 201+202"));
  EXPECT_EQ(result.statistics.gaps, 0U);
  // Near misses: a frame that never returned, and a master with few indices.
  const std::string late = "+32ms FPRD 0x1001:0x0130 08 00 idx=";
  EXPECT_THAT(PairUp(Numbered(20, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=4 @lost\n" + Numbered(79, 5, 16) + late +
                     "4\n" + Numbered(60, 5, 16))
                  .log.gaps,
              ElementsAre("silence 200+201"));
  EXPECT_THAT(PairUp(Numbered(100, 0, 4) + late + "0\n" + Numbered(60, 1, 4)).log.gaps, ElementsAre("silence 201+202"));
}

TEST(PairingGap, ManyIndicesShowThatAMasterWasSilent) {
  const Paired result =
      PairUp(Numbered(100, 0, 256) + "+32ms FPRD 0x1001:0x0130 08 00 idx=100\n" + Numbered(60, 101, 256));
  EXPECT_THAT(result.log.gaps, IsEmpty());
}

TEST(PairingGap, AfterASilenceTheIndexAtWhichACounterRestartsShowsNothing) {
  const auto after = [](const std::string& silence) {
    return PairUp(Numbered(512, 0, 256) + silence + Numbered(60, 1, 256)).statistics.last_loose;
  };
  EXPECT_NE(after("+32ms FPRD 0x1001:0x0130 08 00 idx=0\n"), 1025U);
  EXPECT_EQ(after("+300ms FPRD 0x1001:0x0130 08 00 idx=0\n"), 1025U);
  // Elsewhere the next index shows that none is missing.
  EXPECT_EQ(PairUp(Numbered(500, 0, 256) + "+300ms FPRD 0x1001:0x0130 08 00 idx=244\n").statistics.last_loose, 0U);
}

TEST(PairingGap, OneIndexForAllShowsNothing) {
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += "+1ms FPRD 0x1001:0x0130 08 00 idx=0\n";
  const Paired result = PairUp(lines + "+1ms LRW 0x1000 01 02 idx=0 @lost\n" + lines +
                               "+1ms LRW 0x1000 01 03 idx=0 @lost\n+20ms FPRD 0x1001:0x0130 08 00 idx=0\n" + lines);
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost 201"));
  EXPECT_THAT(result.log.Only("undecided"), ElementsAre("undecided 402"));
  EXPECT_THAT(result.log.gaps, ElementsAre("silence 403+404"));
}

TEST(PairingGap, FramesWithoutNumbersBetweenOthersAreNone) {
  // TwinCAT: cyclic frames have index 0, the others count from 128 to 239.
  std::string lines;
  for (int i = 0; i < 300; ++i) {
    lines += "+1ms LRW 0x1000 01 02 idx=0\n+50us FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(128 + i % 112) + "\n";
  }
  EXPECT_THAT(PairUp(lines).log.gaps, IsEmpty());
}

TEST(PairingGap, CyclicAndAcyclicFramesNumberedSideBySideAreOne) {
  // One mailbox frame, with numbers of its own, behind so many cycles.
  for (const int cycles : {20, 50}) {
    std::string lines;
    int mailbox = 0;
    for (int i = 0; i < 1000; ++i) {
      lines += "+1ms LRW 0x1000 01 02 idx=" + std::to_string(i % 256) + "\n";
      if (i % cycles == 11) lines += "+50us FPRD 0x1001:0x1000 01 idx=" + std::to_string(mailbox++ % 256) + "\n";
    }
    EXPECT_LE(PairUp(lines).log.gaps.size(), 2U) << "before it shows that there are two kinds";
  }
}

TEST(PairingGap, AReturnAfterItShowsItToo) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+5ms FPRD 0x1001:0x0130 08 00 idx=13 @returned-only\n" + Numbered(60, 14, 16));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole +81"));
}

TEST(PairingGap, AMissedOutboundCopyIsNone) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @returned-only\n" + Numbered(60, 9, 16));
  EXPECT_THAT(result.log.gaps, IsEmpty());
  EXPECT_EQ(result.statistics.missed_outbound, 1U);
}

TEST(PairingGap, AReturnLikeOneBeforeItIsNoSecondCopy) {
  // The index came round to that of a frame six before; a second copy would not have taken five cycles.
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+5ms FPRD 0x1001:0x0130 08 00 idx=2 @returned-only\n" + Numbered(60, 3, 16));
  EXPECT_THAT(result.log.Only("dup"), IsEmpty());
  EXPECT_THAT(result.log.gaps, ElementsAre("hole +81"));
}

TEST(PairingGap, AReturnWhoseIndexIsNextIsNoSecondCopy) {
  std::string lines = "@rtt 10us\n";
  for (int i = 0; i < 100; ++i) {
    lines += "+20us FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i % 16) +
             (i >= 40 && i < 60 ? " @returned-only\n" : "\n");
  }
  const Paired result = PairUp(lines);
  EXPECT_THAT(result.log.Only("dup"), IsEmpty());
  EXPECT_EQ(result.statistics.missed_outbound, 20U);
}

/// `count` polls with the same index, `apart` one behind the other, as lines of a trace.
std::string Unnumbered(int count, const std::string& apart) {
  std::string lines;
  for (int i = 0; i < count; ++i) lines += "+" + apart + " FPRD 0x1001:0x0130 08 00 idx=0\n";
  return lines;
}

TEST(PairingGap, AReturnWithoutNumberShowsOfOneOfUnknownSize) {
  const Paired result =
      PairUp(Unnumbered(40, "1ms") + "+3ms FPRD 0x1001:0x0110 02 00 idx=0 @returned-only\n" + Unnumbered(60, "1ms"));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole +81"));
  EXPECT_EQ(result.statistics.missed_outbound, 1U);
  EXPECT_EQ(result.statistics.gaps, 0U) << "no index skips";
  const Paired one =
      PairUp(Unnumbered(40, "1ms") + "+1ms FPRD 0x1001:0x0110 02 00 idx=0 @returned-only\n" + Unnumbered(60, "1ms"));
  EXPECT_THAT(one.log.gaps, IsEmpty()) << "no time for more than its own outbound copy";
}

TEST(PairingGap, AReturnWithoutNumberShowsNothingWhereAPacketCannotBeRead) {
  const Paired result = PairUp(Unnumbered(40, "1ms") + "+1ms FPRD 0x1001:0x0130 08 00 idx=0 @cut=10\n" +
                               "+1ms FPRD 0x1001:0x0110 02 00 idx=0 @returned-only\n" + Unnumbered(60, "1ms"));
  EXPECT_THAT(result.log.gaps, IsEmpty());
}

TEST(PairingGap, AReturnShowsNothingOfAMasterWhoseFramesAreNotCapturedOnTheirWayOut) {
  const Paired result = PairUp("@returned-only\n" + Unnumbered(40, "1ms") + "+1ms FPRD 0x1001:0x0110 02 00 idx=0\n");
  EXPECT_THAT(result.log.gaps, IsEmpty());
}

TEST(PairingGap, AReturnBetweenItAndTheNextFrameComesFirst) {
  // Frames 40 to 51 are missing, and frame 52 is on its way when frame 51 comes back.
  const Paired result =
      PairUp(Numbered(40, 0, 256) + "+11ms FPRD 0x1001:0x0130 08 00 idx=51 rtt=90us @returned-only\n" +
             "+20us FPRD 0x1001:0x0130 08 00 idx=52 rtt=90us\n" + Numbered(20, 53, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole +82"));
}

TEST(PairingGap, AReturnWhoseNumberIsThatOfTheFrameBeforeTheOneInFlightIsNoFlippedBit) {
  const Paired result = PairUp(Numbered(40, 0, 256) + "+1ms FPRD 0x1001:0x0130 08 00 idx=40 rtt=90us @returned-only\n" +
                               "+20us FPRD 0x1001:0x0130 08 00 idx=41 rtt=90us\n" + Numbered(20, 42, 256));
  EXPECT_EQ(result.statistics.altered, 0U);
  EXPECT_EQ(result.statistics.missed_outbound, 1U);
}

TEST(PairingGap, WhatWasSentBeforeItAndComesBackAfterItIsNotReordered) {
  const Paired result = PairUp(Numbered(40, 0, 256) + "+1ms FPRD 0x1001:0x0130 08 00 idx=40 rtt=90us\n" +
                               "+20us FPRD 0x1001:0x0130 08 00 idx=42 rtt=90us\n" + Numbered(20, 43, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole 82+84"));
  EXPECT_EQ(result.statistics.reordered, 0U);
  EXPECT_EQ(result.statistics.paired, 62U);
}

TEST(PairingGap, WhatHasNoNumberAndComesARoundLaterIsNoSecondCopy) {
  const std::string missed = "+100us FPRD 0x1001:0x0130 08 00 idx=0 @returned-only\n";
  const Paired result = PairUp(Unnumbered(40, "100us") + missed + Unnumbered(60, "100us"));
  EXPECT_THAT(result.log.Only("dup"), IsEmpty());
  const Paired twice = PairUp(Unnumbered(40, "100us") + "+100us FPRD 0x1001:0x0130 08 00 idx=0 @twice\n");
  EXPECT_EQ(twice.log.Only("dup").size(), 1U);
}

TEST(PairingGap, AReturnWhoseNumberAnotherFrameHadIsNotFromBeforeThoseInFlight) {
  // Frame 8 is under way for ever, and frame 7 has come back: this is another frame 7.
  const Paired result = PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @lost\n" +
                               "+15ms FPRD 0x1001:0x0120 08 00 idx=7 @returned-only\n" + Numbered(60, 8, 16));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole +82"));
}

TEST(PairingGap, AReturnWithoutNumberThatIsNotLikeTheFrameInFlightIsNoFlippedBit) {
  const Paired result = PairUp(Unnumbered(40, "1ms") + "+1ms FPRD 0x1001:0x0130 08 00 idx=0 @lost\n" +
                               "+3ms FPRD 0x1001:0x080D 08 00 idx=0 @returned-only\n" + Unnumbered(60, "1ms"));
  EXPECT_EQ(result.statistics.altered, 0U);
  EXPECT_THAT(result.log.gaps, ElementsAre("hole +82"));
  // Registers 0x0805 and 0x080D differ by one bit, and are polled in turns.
  std::string polls;
  for (int i = 0; i < 40; ++i) polls += "+1ms FPRD 0x1001:0x0805 08 idx=0\n+1ms FPRD 0x1001:0x080D 08 idx=0\n";
  const Paired turns = PairUp(polls + "+1ms FPRD 0x1001:0x0805 08 idx=0 @lost\n" +
                              "+1ms FPRD 0x1001:0x080D 08 idx=0 @returned-only\n" + polls);
  EXPECT_EQ(turns.statistics.altered, 0U);
}

TEST(PairingGap, AReturnWithoutNumberThatComesLateMayAnswerAnotherFrame) {
  const Paired result = PairUp(Unnumbered(40, "1ms") + "+1ms FPRD 0x1001:0x0130 08 00 idx=0 rtt=26ms\n" +
                               "+28ms FPRD 0x1001:0x0130 08 00 idx=0\n");
  EXPECT_THAT(result.log.gaps, ElementsAre("silence 81+82 at return", "silence 83+84"));
  const Paired numbered = PairUp(Numbered(40, 0, 256) + "+1ms FPRD 0x1001:0x0130 08 00 idx=40 rtt=26ms\n");
  EXPECT_THAT(numbered.log.gaps, IsEmpty());
}

TEST(PairingGap, ALongSilenceShowsAfterAFewFrames) {
  const std::string few = Unnumbered(6, "100us");
  EXPECT_THAT(PairUp(few + "+50ms FPRD 0x1001:0x0130 08 00 idx=9\n").log.gaps, ElementsAre("silence 13+14"));
  EXPECT_THAT(PairUp(few + "+5ms FPRD 0x1001:0x0130 08 00 idx=9\n").log.gaps, IsEmpty());
  EXPECT_THAT(PairUp(few + "+50ms FPRD 0x1001:0x0130 08 00 idx=0\n").log.gaps, IsEmpty()) << "it waits";
}

TEST(PairingGap, SixteenIndicesComeRoundWhereAReturnIsMissingAndTheMasterWasFastBefore) {
  std::string burst;
  for (int i = 0; i < 40; ++i) burst += "+50us FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i % 16) + "\n";
  const std::string behind = "+5ms FPRD 0x1001:0x0120 08 00 idx=1\n" + Numbered(20, 2, 16);
  const std::string before = burst + Numbered(40, 8, 16);
  const std::string slower = "rounds 81+82";  // where it sends less often for the first time
  EXPECT_THAT(PairUp(before + "+1ms FPRD 0x1001:0x0130 08 00 idx=0 @lost\n" + behind).log.gaps,
              ElementsAre(slower, "silence 162+163"));
  EXPECT_THAT(PairUp(before + "+1ms FPRD 0x1001:0x0130 08 00 idx=0\n" + behind).log.gaps, ElementsAre(slower))
      << "nothing is missing but time";
}

TEST(PairingGap, AFrameThatCannotBeReadHasAnIndexAllTheSame) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @cut=20\n" + Numbered(60, 9, 16));
  EXPECT_THAT(result.log.gaps, IsEmpty());
}

TEST(PairingGap, StampsThatGoBackAreNoneWhereIndicesGoOn) {
  for (const int round : {16, 256}) {
    Result<Trace> trace = Trace::Parse(Numbered(300, 0, round));
    ASSERT_TRUE(trace);
    std::vector<Packet> packets = trace->Packets();
    for (std::size_t i = 400; i < packets.size(); ++i) packets[i].time -= 3600'000'000'000;
    EXPECT_THAT(PairUp(packets).log.gaps, IsEmpty());
  }
}

TEST(PairingGap, AReturnOfUnknownOriginAfterAStepBackIsNotCountedByIt) {
  // The index went back before any step was counted: there is no round yet to count by.
  const Paired result = PairUp(R"(
+0us BRD 0x0130 01 00 idx=15
+1ms BRD 0x0130 01 00 idx=1 @lost
+1ms LRD 0x1000 00 00 idx=0 @returned-only
)");
  EXPECT_EQ(result.statistics.paired, 1U);
  EXPECT_EQ(result.statistics.unmatched_returned, 1U);
}

TEST(PairingGap, AMasterThatAppearsLateFollowsAnotherCapture) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8 @lost\n@mac 10:10:10:10:10:10\n" +
             Numbered(60, 3, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole 82+83"));
  EXPECT_THAT(result.log.Only("lost"), IsEmpty());
}

/// What a tap writes whose clock of the returns is `early_ns` behind.
std::vector<Packet> Skewed(const std::string& lines, TimeNs early_ns) {
  Result<Trace> trace = Trace::Parse("@two-interfaces\n" + lines);
  EXPECT_TRUE(trace);
  std::vector<Packet> packets = trace->Packets();
  for (Packet& packet : packets) {
    if (packet.interface_index == 1) packet.time -= early_ns;
  }
  std::stable_sort(packets.begin(), packets.end(), [](const Packet& a, const Packet& b) { return a.time < b.time; });
  return packets;
}

TEST(Pairing, ReturnsStampedBeforeTheirFramesArePairedByIndexAndContent) {
  const Paired result = PairUp(
      Skewed(Numbered(60, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=12 @lost\n" + Numbered(60, 13, 16), 60'000));
  EXPECT_EQ(result.statistics.paired, 120U);
  EXPECT_EQ(result.statistics.lost, 1U);
  EXPECT_EQ(result.statistics.stamped_first, 120U);
  EXPECT_THAT(result.log.words, ::testing::Each(::testing::AnyOf(::testing::StartsWith("+"), "lost 121")));
  EXPECT_EQ(result.statistics.missed_outbound, 0U);
  EXPECT_EQ(result.statistics.unmatched_returned, 0U);
  EXPECT_TRUE(result.statistics.frames().Balances());
}

TEST(Pairing, AnOutboundCopyThatTheRecorderMissedIsNoSkew) {
  std::string lines = Numbered(60, 0, 16);
  for (int i = 0; i < 20; ++i) {
    lines += "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string((12 + 2 * i) % 16) + " @returned-only\n" +
             "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string((13 + 2 * i) % 16) + "\n";
  }
  const Paired result = PairUp(Skewed(lines, 0));
  EXPECT_EQ(result.statistics.stamped_first, 0U);
  EXPECT_EQ(result.statistics.missed_outbound, 20U);
}

TEST(Pairing, WhatIsSentBeforeAnybodyAnswersIsNotLost) {
  std::string lines;
  for (int i = 0; i < 20; ++i) lines += "+20ms BRD 0x0000 00 idx=" + std::to_string(i % 16) + " @lost\n";
  lines += "+20ms BRD 0x0000 11 idx=4\n" + Numbered(20, 5, 16);
  const Paired result = PairUp(lines);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.undecided[static_cast<std::size_t>(Undecided::kNoAnswers)], 20U);
  EXPECT_EQ(result.log.Only("21+22").size(), 1U) << "not the frame of the same index long before";
  EXPECT_EQ(result.statistics.dropped_every, 0U);
  EXPECT_TRUE(result.statistics.frames().Balances());
}

TEST(PairingGap, AMasterThatAppearsInTheMiddleOfItsWorkFollowsAnotherCapture) {
  const Paired result = PairUp(Numbered(40, 0, 16) + "@mac 10:10:10:10:10:10\n" + Numbered(60, 3, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole 81+82"));
  EXPECT_EQ(result.statistics.gaps, 1U);
}

TEST(PairingGap, AMasterThatSetsTheBusUpWhenNothingIsInFlightIsAnotherProgram) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "@mac 10:10:10:10:10:10\n+1ms BRD 0x0000 11 00 idx=0\n" + Numbered(60, 1, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("silence 81+82"));
  EXPECT_EQ(result.statistics.gaps, 0U);
  EXPECT_EQ(result.statistics.paired, 101U);
}

TEST(PairingGap, IndicesThatSkipWithoutTimeForTheFramesBetweenAreNoGap) {
  // 60 frames take at least 0.4 ms.
  const std::string skip = "FPRD 0x1001:0x0130 08 00 idx=100\n" + Numbered(30, 101, 256);
  EXPECT_THAT(PairUp(Numbered(40, 0, 256) + "+60us " + skip).log.gaps, IsEmpty());
  EXPECT_EQ(PairUp(Numbered(40, 0, 256) + "+60us " + skip).statistics.gaps, 0U);
  EXPECT_THAT(PairUp(Numbered(40, 0, 256) + "+2ms " + skip).log.gaps, ElementsAre("skip 81+82"));
  EXPECT_THAT(PairUp(Numbered(40, 0, 256) + "+60ms " + skip).log.gaps, ElementsAre("hole 81+82"));
}

TEST(PairingGap, WhereEachDatagramHasANumberFewerFramesAreMissing) {
  // 5 frames of 10 datagrams fit into 700 us, 50 frames do not at the rate of this master.
  const auto frames = [](int first, int count) {
    std::string lines;
    for (int i = 0; i < count; ++i) {
      lines += "+100us";
      for (int d = 0; d < 10; ++d) {
        lines += d == 0 ? " " : " & ";
        lines += "FPRD 0x1001:0x0130 08 00 idx=" + std::to_string((first + 10 * i + d) % 256);
      }
      lines += "\n";
    }
    return lines;
  };
  const auto poll = [](int index) { return "FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(index % 256) + "\n"; };
  const Paired result = PairUp(frames(0, 80) + "+100us " + poll(800) + "+600us " + frames(851, 80).substr(7));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole 163+164"));
}

TEST(PairingGap, StampsThatFramesShareDoNotShowThatThereWasNoTime) {
  std::string before = "@rtt 30us\n@resolution 400us\n", after;
  for (int i = 0; i < 100; ++i) before += "+53us FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i) + "\n";
  for (int i = 113; i < 200; ++i) after += "FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i) + "\n+53us ";
  after += "FPRD 0x1001:0x0130 08 00 idx=200\n";
  const Paired result = PairUp(before + "+690us " + after);
  EXPECT_THAT(result.log.gaps, ElementsAre("likely skip 201+202"));
}

TEST(PairingGap, IndicesThatSkipWhileAFrameIsInFlightAreAGapHoweverSoon) {
  const Paired result = PairUp(Numbered(40, 0, 256) + "+1ms FPRD 0x1001:0x0130 08 00 idx=40 @lost\n" +
                               "+60us FPRD 0x1001:0x0130 08 00 idx=100\n" + Numbered(30, 101, 256));
  EXPECT_THAT(result.log.gaps, ElementsAre("hole 82+83"));
}

TEST(PairingRepeated, AnAnsweredFrameThatIsSentAgainIsNoGap) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x0130 08 00 idx=8\n" +
             "+2ms FPRD 0x1001:0x0130 08 00 idx=8\n+2ms FPRD 0x1001:0x0130 08 00 idx=8\n" + Numbered(60, 9, 16));
  EXPECT_THAT(result.log.gaps, IsEmpty());
  EXPECT_THAT(result.log.repeats, ElementsAre("81+82 again 83", "83+84 again 85"));
  EXPECT_EQ(result.statistics.paired, result.statistics.outbound);
}

TEST(PairingRepeated, AWholeRoundOfIndicesMayBeMissing) {
  // 15 of 16 frames, 255 of 256, one of two with an index of its own each.
  const std::string poll = " FPRD 0x1001:0x0130 08 00 idx=";
  for (const auto& [round, apart] : {std::pair{16, "16ms"}, std::pair{16, "32ms"}, std::pair{2, "2ms"}}) {
    const Paired result =
        PairUp(Numbered(48, 0, round) + "+" + apart + poll + std::to_string(round - 1) + "\n" + Numbered(60, 0, round));
    EXPECT_THAT(result.log.repeats, ElementsAre("95+96 again 97 or gap")) << round << " " << apart;
    EXPECT_THAT(result.log.gaps, ElementsAre("silence 97+98")) << round << " " << apart;
  }
  EXPECT_THAT(PairUp(Numbered(300, 0, 256) + "+64ms" + poll + "43\n" + Numbered(60, 44, 256)).log.repeats,
              ElementsAre("599+600 again 601"))
      << "255 frames do not fit at the rate of this master";
}

TEST(PairingRepeated, WhatNoSlaveAnsweredMayBeTriedAgain) {
  const std::string again = "FPRD 0x1001:0x0130 08 00 idx=8 wkc=0\n";
  const Paired result = PairUp(Numbered(40, 0, 16) + "+1ms " + again + "+2ms " + again + Numbered(60, 9, 16));
  EXPECT_THAT(result.log.repeats, IsEmpty());
  EXPECT_THAT(result.log.gaps, IsEmpty());
}

TEST(PairingRepeated, APollThatKeepsItsIndexBringsNewsInTheEnd) {
  const Paired result =
      PairUp(Numbered(40, 0, 16) + "+1ms FPRD 0x1001:0x080D 00 idx=8\n+1ms FPRD 0x1001:0x080D 00 idx=8\n" +
             "+1ms FPRD 0x1001:0x080D 08 idx=8\n" + Numbered(60, 9, 16));
  EXPECT_THAT(result.log.repeats, ElementsAre("81+82 again 83", "83+84 again 85 news"));
}

TEST(PairingRepeated, EqualFramesWithoutNumberAreNotSentAgain) {
  EXPECT_THAT(PairUp(Numbered(40, 0, 1)).log.repeats, IsEmpty());
}

TEST(PairingRepeated, WhatComesBackAfterItWasSentAgainComesBackInOrder) {
  const std::string again = "FPRD 0x1001:0x0130 08 00 idx=8 rtt=";
  const Paired result = PairUp(Numbered(40, 0, 16) + "+1ms " + again + "8700us\n+2ms " + again + "6712us\n+2ms " +
                               again + "4724us\n+6ms FPRD 0x1001:0x0130 08 00 idx=9\n" + Numbered(60, 10, 16));
  EXPECT_THAT(result.log.gaps, IsEmpty());
  EXPECT_THAT(result.log.Only("lost"), IsEmpty());
  EXPECT_THAT(result.log.Only("dup"), IsEmpty());
  EXPECT_THAT(result.log.repeats, ElementsAre("81+84 late after 82", "82+85 late after 83"));
}

}  // namespace
}  // namespace ecaudit::bus::test
