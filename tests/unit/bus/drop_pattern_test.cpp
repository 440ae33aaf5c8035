#include "decoder/bus/drop_pattern.h"

#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

/// `count` frames and their returns, a foreign packet behind every `other_every`-th frame.
std::vector<Packet> SomeTraffic(int count, int other_every) {
  std::string lines;
  for (int i = 0; i < count; ++i) {
    lines += "+1ms LRW 0x1000 01 02 idx=" + std::to_string(i % 256) + "\n";
    if (other_every != 0 && i % other_every == 0) lines += "+100us OTHER\n";
  }
  Result<Trace> trace = Trace::Parse(lines);
  EXPECT_TRUE(trace);
  return trace->Packets();
}

std::vector<Packet> Without(const std::vector<Packet>& packets, std::size_t every, std::size_t from) {
  std::vector<Packet> out;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    if (i < from || (i - from) % every != 0) out.push_back(packets[i]);
  }
  return out;
}

TEST(DropPattern, EveryPacketAtADistanceIsTheRecorders) {
  const Paired result = PairUp(Without(SomeTraffic(1000, 10), 124, 160));
  EXPECT_EQ(result.statistics.dropped_every, 124U);
  EXPECT_LE(result.statistics.lost, 1U);
  EXPECT_TRUE(result.statistics.frames().Balances());
}

TEST(DropPattern, OfBothDirections) {
  const Paired result = PairUp(Without(SomeTraffic(1000, 0), 123, 160));
  EXPECT_EQ(result.statistics.dropped_every, 123U);
  EXPECT_LE(result.statistics.lost, 1U);
  EXPECT_GT(result.statistics.missed_outbound, 4U);
}

TEST(DropPattern, FromTheBeginningOn) {
  const Paired result = PairUp(Without(SomeTraffic(1000, 0), 124, 123));
  EXPECT_EQ(result.statistics.dropped_every, 124U);
  EXPECT_EQ(result.statistics.lost, 0U);
}

TEST(DropPattern, FramesThatABusLosesAreLost) {
  // Every fiftieth frame, however many packets of others lie between.
  for (const int other_every : {0, 7}) {
    std::vector<Packet> packets = SomeTraffic(1000, other_every);
    std::vector<Packet> kept;
    int returned = 0;
    for (const Packet& packet : packets) {
      const bool back = packet.bytes.size() > 12 && (packet.bytes[6] & 2U) != 0 && packet.bytes[12] == 0x88;
      if (!back || ++returned % 50 != 20) kept.push_back(packet);
    }
    const Paired result = PairUp(kept);
    EXPECT_EQ(result.statistics.dropped_every, 0U) << other_every;
    EXPECT_EQ(result.statistics.lost, 20U) << other_every;
  }
}

TEST(DropPattern, ATimeInWhichNothingComesBackIsNone) {
  for (const bool others_before : {false, true}) {
    DropPattern pattern;
    // One frame sent, and none that came back, between any two.
    if (others_before) pattern.MissOutbound(5, 3);
    for (FrameNo at = 11; at < 61; ++at) pattern.MissReturn(at, at - 5);
    pattern.Finish();
    EXPECT_EQ(pattern.distance(), 0U) << others_before;
  }
}

TEST(DropPattern, AFewAreNoPattern) {
  DropPattern pattern;
  for (FrameNo at = 1000; at < 1400; at += 100) pattern.MissReturn(at, at / 2);
  pattern.Finish();
  EXPECT_EQ(pattern.distance(), 0U);
}

}  // namespace
}  // namespace ecaudit::bus::test
