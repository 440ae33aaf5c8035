// Captures that hold every packet twice.
#include "decoder/bus/doubled_packets.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

/// Every packet once more, `ns` later, on that interface.
std::vector<Packet> Doubled(const std::vector<Packet>& packets, TimeNs ns, std::uint16_t interface) {
  std::vector<Packet> all;
  for (const Packet& packet : packets) {
    all.push_back(packet);
    all.push_back(packet);
    all.back().time += ns;
    all.back().interface_index = interface;
  }
  return all;
}

/// As a master sends whose address has the bit that slaves set.
std::vector<Packet> WithoutBit(const std::string& lines) {
  Result<Trace> trace = Trace::Parse(lines);
  EXPECT_TRUE(trace);
  std::vector<Packet> packets = trace->Packets();
  for (Packet& packet : packets) packet.bytes[6] |= 2U;
  return packets;
}

std::string Work(int frames) {
  std::string lines = "@slaves 2\n";
  for (int i = 0; i < frames; ++i) {
    lines +=
        i % 3 == 0 ? "+1ms BRD 0x0130 08 00\n" : "+1ms FPRD 0x1001:0x080D 00 wkc=" + std::to_string(i % 3 - 1) + "\n";
  }
  return lines;
}

TEST(DoubledPackets, CountOnceWhereTheAddressShowsNothing) {
  const std::vector<Packet> packets = WithoutBit(Work(300));
  const PairingStatistics once = StatisticsOf(packets);
  ASSERT_EQ(once.paired, 300U);
  for (const TimeNs later : {TimeNs{0}, TimeNs{4'000}}) {
    for (const std::uint16_t interface : {std::uint16_t{0}, std::uint16_t{1}}) {
      const PairingStatistics twice = StatisticsOf(Doubled(packets, later, interface));
      EXPECT_EQ(twice.paired, 300U) << later << " on " << interface;
      EXPECT_EQ(twice.outbound, 300U);
      EXPECT_EQ(twice.returned, 300U);
      EXPECT_EQ(twice.captured_twice, 600U);
      EXPECT_EQ(twice.lost, 0U);
      EXPECT_EQ(twice.duplicated, 0U);
    }
  }
}

TEST(DoubledPackets, ALongRoundTripIsNoRepetition) {
  Result<Trace> trace = Trace::Parse(Work(100) + "+1ms FPRD 0x1001:0x0130 08 00 rtt=700us\n" + Work(100).substr(10));
  ASSERT_TRUE(trace);
  const PairingStatistics twice = StatisticsOf(Doubled(trace->Packets(), 2'000, 1));
  EXPECT_EQ(twice.paired, 201U);
  EXPECT_EQ(twice.lost, 0U);
}

/// One index and one answer for all: each return is like the one before, but the next frame stands between them.
TEST(DoubledPackets, PollsThatAreAllAlikeAreNotThat) {
  std::string lines;
  for (int i = 0; i < 300; ++i) lines += "+50us FPRD 0x1001:0x0130 08 00 idx=0\n";
  for (const bool bit : {true, false}) {
    Result<Trace> trace = Trace::Parse(lines);
    ASSERT_TRUE(trace);
    const PairingStatistics read = StatisticsOf(bit ? trace->Packets() : WithoutBit(lines));
    EXPECT_EQ(read.paired, 300U);
    EXPECT_EQ(read.captured_twice, 0U);
  }
}

TEST(DoubledPackets, WhatOnlyCameBackTwiceIsLeftToTheRules) {
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += "+1ms FPRD 0x1001:0x0130 08 00 @twice\n";
  Result<Trace> trace = Trace::Parse(lines);
  ASSERT_TRUE(trace);
  const PairingStatistics read = StatisticsOf(trace->Packets());
  EXPECT_EQ(read.duplicated, 100U);
  EXPECT_EQ(read.captured_twice, 0U);
}

/// Each outbound packet once more, `ns` later; packets in the order of their stamps.
std::vector<Packet> SentDoubled(const std::vector<Packet>& packets, TimeNs ns) {
  std::vector<Packet> all;
  for (const Packet& packet : packets) {
    all.push_back(packet);
    if ((packet.bytes[6] & 2U) != 0) continue;
    all.push_back(packet);
    all.back().time += ns;
  }
  std::stable_sort(all.begin(), all.end(), [](const Packet& a, const Packet& b) { return a.time < b.time; });
  return all;
}

/// Three frames are in flight at a time: other frames stand between both copies.
TEST(DoubledPackets, OnlyTheOutboundOnesOfABridge) {
  std::string lines;
  for (int i = 0; i < 100; ++i) {
    lines +=
        "+1ms FPRD 0x1001:0x0130 08 00 rtt=90us\n+5us FPRD 0x1001:0x080D 00 rtt=90us\n+5us LRW 0x1000 01 02 rtt=90us\n";
  }
  Result<Trace> trace = Trace::Parse(lines);
  ASSERT_TRUE(trace);
  for (const TimeNs later : {1'000, 7'000, 20'000, 49'000}) {
    const PairingStatistics read = StatisticsOf(SentDoubled(trace->Packets(), later));
    EXPECT_EQ(read.paired, 300U) << later;
    EXPECT_EQ(read.lost, 0U) << later;
    EXPECT_EQ(read.captured_twice, 300U) << later;
  }
}

/// A master that sends the same once more because nothing returned: the first ones are lost.
TEST(DoubledPackets, ARepetitionAfterATimeOutIsNone) {
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += "+3ms FPRD 0x1001:0x0130 08 00\n";
  Result<Trace> trace = Trace::Parse(lines);
  ASSERT_TRUE(trace);
  std::vector<Packet> packets = SentDoubled(trace->Packets(), 1'500'000);
  for (Packet& packet : packets) {
    if ((packet.bytes[6] & 2U) != 0) packet.time += 1'600'000;
  }
  std::stable_sort(packets.begin(), packets.end(), [](const Packet& a, const Packet& b) { return a.time < b.time; });
  const PairingStatistics read = StatisticsOf(packets);
  EXPECT_EQ(read.captured_twice, 0U);
  EXPECT_GE(read.lost, 99U);
}

}  // namespace
}  // namespace ecaudit::bus::test
