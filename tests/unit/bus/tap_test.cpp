// A tap between slaves: the outbound copies have passed some of them (esc-reference 3.4).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Makes the outbound copies look as they do behind `upstream` slaves that all take part.
std::vector<Packet> IsTappedAfterSlaves(const Trace& trace, std::uint16_t upstream) {
  std::vector<Packet> packets = trace.Packets();
  for (Packet& packet : packets) {
    if ((packet.bytes[6] & 2U) != 0) continue;
    packet.bytes[6] = static_cast<std::uint8_t>(packet.bytes[6] | 2U);
    const std::uint8_t command = packet.bytes[16];
    const auto add = [&](std::size_t offset, std::uint16_t n) {
      const auto value = static_cast<std::uint16_t>(packet.bytes[offset] + packet.bytes[offset + 1] * 256U + n);
      packet.bytes[offset] = static_cast<std::uint8_t>(value & 0xFFU);
      packet.bytes[offset + 1] = static_cast<std::uint8_t>(value >> 8U);
    };
    const bool counts = command <= 3 || (command >= 7 && command <= 9) || command == 13;
    if (counts && command != 0) add(18, upstream);
    const std::size_t length = packet.bytes[22] + (packet.bytes[23] & 7U) * 256U;
    if (command == 7 || command == 8) add(26 + length, upstream);
    if (command == 12) add(26 + length, static_cast<std::uint16_t>(3 * upstream));
  }
  return packets;
}

TEST(Tap, BetweenSlavesFromTheStart) {
  Trace trace;
  trace.Slaves(3);
  trace.After(100).Brd(0x0000, {0x11, 0});
  for (std::uint16_t position = 0; position < 3; ++position) {
    trace.After(100).Aprd(position, 0x0140, {5, 0});
    trace.After(100).Apwr(position, 0x0010, {static_cast<std::uint8_t>(position + 1), 0x10});
  }
  for (int i = 0; i < 20; ++i)
    trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i % 4));
  const Paired result = PairUp(IsTappedAfterSlaves(trace, 1));
  EXPECT_EQ(result.statistics.paired, 27U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.unmatched_returned, 0U);
}

TEST(Tap, MidRunBeginsWithAReturn) {
  // Every copy has a working counter above 0; the first frame in the file is one that comes back. With one index only
  // all frames are equal but for their counters.
  for (const int indices : {1, 16}) {
    Trace trace;
    trace.Slaves(2);
    for (int i = 0; i < 100; ++i) {
      auto& frame =
          trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i % indices));
      if (i == 0) frame.ReturnedOnly();
    }
    const Paired result = PairUp(IsTappedAfterSlaves(trace, 1));
    EXPECT_EQ(result.statistics.paired, 99U) << indices;
    EXPECT_EQ(result.statistics.lost, 0U) << indices;
    EXPECT_EQ(result.statistics.frames().undecided_total() + result.statistics.in_flight, 1U) << indices;
  }
}

TEST(Tap, LossesAfterSlavesAreSeen) {
  Trace trace;
  trace.Slaves(2);
  for (int i = 0; i < 100; ++i) {
    auto& frame = trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i % 16));
    if (i == 50) frame.Lost().Mark("lost");
  }
  const Paired result = PairUp(IsTappedAfterSlaves(trace, 1));
  EXPECT_THAT(result.log.Only("lost"), ElementsAre("lost " + std::to_string(trace.Sent("lost"))));
}

/// Polls of the slave before the tap, and of the one behind it, between process data of both.
std::string PollsOfBothSides(int cycles, int first_index) {
  std::string lines;
  int index = first_index;
  const auto add = [&](const std::string& line) { lines += line + " idx=" + std::to_string(index++ % 16) + "\n"; };
  for (int i = 0; i < cycles; ++i) {
    add("+1ms LRW 0x1000 01 02 -> 03 04 swkc=3 wkc=6");
    add("+100us FPRD 0x1001:0x0130 08 00 -> 08 00 swkc=1 wkc=1");
    add("+100us FPRD 0x1002:0x0130 08 00 wkc=1");
  }
  return lines;
}
constexpr const char* kBehindASlave = "@mac 03:01:01:01:01:01\n";

TEST(Tap, WhatOnlySlavesBeforeItAnswerComesBackAsItPassed) {
  const Paired result = PairUp(kBehindASlave + PollsOfBothSides(40, 0));
  EXPECT_EQ(result.statistics.paired, 120U);
  EXPECT_EQ(result.statistics.outbound, 120U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.frames().undecided_total() + result.statistics.in_flight, 0U);
}

TEST(Tap, AfterASingleSlaveThatFewFramesCount) {
  // A start-up asks each of the others more than the one before the tap.
  std::string lines;
  int index = 0;
  const auto add = [&](const std::string& line) { lines += line + " idx=" + std::to_string(index++ % 16) + "\n"; };
  for (int i = 0; i < 20; ++i) {
    add("+1ms BRD 0x0130 00 00 -> 02 00 swkc=1 wkc=3");
    for (int n = 0; n < 12; ++n) add("+100us FPRD 0x1002:0x0130 00 00 -> 02 00 wkc=1");
    add("+100us FPRD 0x1001:0x0130 02 00 -> 02 00 swkc=1 wkc=1");
  }
  const Paired result = PairUp(kBehindASlave + lines);
  EXPECT_EQ(result.statistics.outbound, 280U);
  EXPECT_EQ(result.statistics.paired, 280U);
  EXPECT_EQ(result.statistics.unmatched_returned, 0U);
}

TEST(Tap, WhatIsRepeatedAfterATimeOutIsNoReturn) {
  const std::string poll = "+2ms FPRD 0x1001:0x0130 08 00 -> 08 00 swkc=1 wkc=1 idx=8";
  const Paired result =
      PairUp(kBehindASlave + PollsOfBothSides(40, 0) + poll + " @lost\n" + poll + "\n" + PollsOfBothSides(40, 9));
  EXPECT_EQ(result.statistics.paired, 241U);
  EXPECT_EQ(result.statistics.lost, 1U);
}

TEST(Tap, MasterWithTheBitMidRunBeginsWithAReturn) {
  // No slave before the tap, but the master's own address has the bit: working counters say what came back.
  Trace trace;
  trace.Mac({0x02, 0, 0, 0, 0, 1});
  for (int i = 0; i < 100; ++i) {
    auto& frame = trace.After(1000).Lrw(0x1000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i % 16));
    if (i == 0) frame.ReturnedOnly();
  }
  const Paired result = PairUp(trace);
  EXPECT_EQ(result.log.words.front(), "+1");
  EXPECT_EQ(result.statistics.paired, 99U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_THAT(result.log.Only("undecided"), IsEmpty());
}

}  // namespace
}  // namespace ecaudit::bus::test
