// SOEM with cable redundancy (esc-reference 3.4): the primary port sends the real frame from 01:01:.., the secondary
// port a BRD with the same index from 04:04:.. . In an intact ring each arrives at the other port.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

using ::testing::IsEmpty;

constexpr samples::MacAddress kPrimary{0x01, 0x01, 0x01, 0x01, 0x01, 0x01};
constexpr samples::MacAddress kSecondary{0x04, 0x04, 0x04, 0x04, 0x04, 0x04};

/// One cycle in an intact ring of three slaves as both ports see it: packet 4i+1 real frame out (interface 0), 4i+2
/// dummy out (1), 4i+3 real frame in (1), 4i+4 dummy in (0).
std::vector<Packet> IntactRing(int cycles) {
  Trace trace;
  trace.Slaves(3);
  for (int i = 0; i < cycles; ++i) {
    const auto index = static_cast<std::uint8_t>(i % 16);
    trace.Mac(kPrimary);
    trace.After(1000).Lrw(0x1000, Bytes(30, 0), Bytes(30, 1)).Index(index);
    trace.Mac(kSecondary);
    trace.After(1).Brd(0x0000, {0x11, 0}).Index(index);
  }
  std::vector<Packet> packets = trace.Packets();
  for (Packet& packet : packets) {
    const bool primary = (packet.bytes[6] & ~2U) == 0x01;
    const bool returned = (packet.bytes[6] & 2U) != 0;
    packet.interface_index = primary == returned ? 1 : 0;
  }
  return packets;
}

std::vector<Packet> OnlyInterface(const std::vector<Packet>& packets, std::uint16_t interface_index) {
  std::vector<Packet> out;
  for (const Packet& packet : packets) {
    if (packet.interface_index == interface_index) out.push_back(packet);
  }
  return out;
}

TEST(Redundancy, IntactRingBothPortsCaptured) {
  const Paired result = PairUp(IntactRing(300));
  EXPECT_EQ(result.statistics.paired, 600U);
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.foreign, 0U);
}

TEST(Redundancy, IntactRingOnlyThePrimaryPortCaptured) {
  // Outbound process frames never come back here; dummies nobody sent here do.
  const Paired result = PairUp(OnlyInterface(IntactRing(600), 0));
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_THAT(result.log.Only("silent"), IsEmpty());
  EXPECT_EQ(result.statistics.outbound, 600U);
  EXPECT_EQ(result.statistics.returned, 600U);
  EXPECT_EQ(result.statistics.unmatched_returned, 600U);
  EXPECT_EQ(result.statistics.duplicated, 0U);
}

TEST(Redundancy, IntactRingOnlyTheSecondaryPortCaptured) {
  const Paired result = PairUp(OnlyInterface(IntactRing(600), 1));
  EXPECT_EQ(result.statistics.lost, 0U);
  EXPECT_EQ(result.statistics.duplicated, 0U);
  EXPECT_EQ(result.statistics.unmatched_returned, 600U);
}

TEST(Redundancy, BrokenRingTheReturnedFrameGoesOutAgain) {
  // Broken behind the first of three slaves: the process frame returns on the primary port with a part of the counter,
  // goes out on the secondary port as it is, and returns there complete.
  for (const bool mac_bit_kept : {false, true}) {
    Trace trace;
    for (int i = 0; i < 400; ++i) {
      const auto index = static_cast<std::uint8_t>(i % 16);
      trace.Mac(kPrimary).Slaves(1);
      trace.After(1000).Lrw(0x1000, Bytes(30, 0), Bytes(30, 1)).Index(index).Wkc(3);
      trace.Mac(kSecondary).Slaves(2);
      trace.After(1).Brd(0x0000, {0x11, 0}).Index(index);
      trace.Mac(mac_bit_kept ? samples::AfterSlave(kPrimary) : kPrimary);
      ecaudit::test::TraceDatagram again;
      again.command = samples::Cmd::LRW;
      again.ado = 0;
      again.adp = 0x1000;
      again.sent = again.returned = Bytes(30, 1);
      again.sent_wkc = 3;
      again.wkc = 9;
      again.index = index;
      trace.After(100).Add(again);
    }
    std::vector<Packet> packets = trace.Packets();
    int place = 0;  // process frame out, dummy out, process frame back, dummy back, process frame out again and back
    for (Packet& packet : packets) {
      packet.interface_index = place % 6 == 0 || place % 6 == 2 ? 0 : 1;
      ++place;
    }
    const Paired result = PairUp(packets);
    EXPECT_EQ(result.statistics.lost, 0U) << mac_bit_kept;
    EXPECT_EQ(result.statistics.duplicated, 0U) << mac_bit_kept;
    EXPECT_EQ(result.log.Only("altered").size(), 0U) << mac_bit_kept;
    EXPECT_EQ(result.statistics.frames().undecided_total(), 0U) << mac_bit_kept;
  }
}

}  // namespace
}  // namespace ecaudit::bus::test
