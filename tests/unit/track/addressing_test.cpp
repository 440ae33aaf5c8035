// Which slaves a datagram meant: positions, station addresses, aliases (esc-reference 2.1, 3.3).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/track/event_log.h"

namespace ecaudit::track::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::string_view kScan = R"(
+1ms BRD  0x0000   11 00
+1ms APWR 0:0x0010 01 10
+1ms APWR 1:0x0010 02 10
+1ms APWR 2:0x0010 03 10
+1ms FPRD 0x1002:0x0130 01 00
)";

void ExpectTheScan(const Decoded& d) {
  ASSERT_EQ(d.slaves().size(), 3U);
  for (SlaveId s = 0; s < 3; ++s) {
    ASSERT_NE(d.slaves()[s].position.if_observed(), nullptr);
    EXPECT_EQ(*d.slaves()[s].position.if_observed(), s);
    EXPECT_EQ(*d.slaves()[s].station.if_known(), 0x1001 + s);
    EXPECT_TRUE(d.slaves()[s].station_valid);
  }
}

TEST(Addressing, OutboundAndReturned) {
  const Decoded d = Decode("@slaves 3\n" + std::string(kScan));
  ExpectTheScan(d);
  EXPECT_THAT(d.log->lines, ElementsAre("count 3", "found 0", "address 0 = 0x1001", "found 1", "address 1 = 0x1002",
                                        "found 2", "address 2 = 0x1003", "state 1 ? -> 0x0001"));
  EXPECT_EQ(*d.network().slave_count().if_observed(), 3);
}

TEST(Addressing, ReturnedOnly) {
  // The returned address of slave p is count - p; the count comes from the broadcast, which masters send with 0.
  const Decoded d = Decode("@slaves 3\n@returned-only\n" + std::string(kScan));
  ExpectTheScan(d);
  EXPECT_EQ(d.log->Only("state"), std::vector<std::string>{"state 1 ? -> 0x0001"});
}

TEST(Addressing, ReturnedOnlyWithoutACountStaysSilent) {
  const Decoded d = Decode("@slaves 3\n@returned-only\n+1ms APRD 1:0x0130 01 00\n+1ms APRD 2:0x0130 01 00\n");
  EXPECT_EQ(d.slaves().size(), 0U);
  EXPECT_THAT(d.log->lines, IsEmpty());
}

TEST(Addressing, OutboundOnlyIsAssumed) {
  const Decoded d = Decode("@slaves 3\n@out-only\n" + std::string(kScan));
  ExpectTheScan(d);
  EXPECT_EQ(d.network().slave_count().if_known(), nullptr);
  EXPECT_EQ(d.Register(0, 0x0010), "0x1001?") << "inferred";
  EXPECT_THAT(d.log->Only("state"), IsEmpty());
}

TEST(Addressing, TapAfterTheFirstSlave) {
  // The outbound copies have passed one slave: addresses of positions and the broadcast are one further.
  Trace trace = *Trace::Parse("@slaves 3\n" + std::string(kScan) + "+1ms BRD 0x0000 11 00 times=20\n");
  std::vector<Packet> packets = trace.Packets();
  for (Packet& packet : packets) {
    if ((packet.bytes[6] & 2U) != 0) continue;
    packet.bytes[6] = static_cast<std::uint8_t>(packet.bytes[6] | 2U);
    if (packet.bytes[16] == 4) continue;  // FPRD
    const auto adp = static_cast<std::uint16_t>(packet.bytes[18] + packet.bytes[19] * 256 + 1);
    packet.bytes[18] = static_cast<std::uint8_t>(adp & 0xFFU);
    packet.bytes[19] = static_cast<std::uint8_t>(adp >> 8U);
    const std::size_t length = packet.bytes[22] + (packet.bytes[23] & 7U) * 256U;
    if (packet.bytes[16] == 7) packet.bytes[26 + length] = 1;  // BRD
  }
  const Decoded d = Decode(packets);
  ExpectTheScan(d);
  EXPECT_EQ(*d.network().slave_count().if_observed(), 3);
}

TEST(Addressing, WhatAMasterSendsInTheAddressOfBroadcastsIsItsAffair) {
  // Its own address has the bit that slaves set. A read that slaves have passed they have counted.
  const Decoded d = Decode(
      "@slaves 3\n@mac 02:01:01:01:01:01\n"
      "+1ms BWR 0x0101 00 adp=0x1000 wkc=0\n"
      "+1ms BWR 0x0120 01 00 adp=0x1000 & BRD 0x0000 11 00 adp=0x1000\n"
      "+1ms APRD 0:0x0010 01 10\n");
  ASSERT_NE(d.network().slave_count().if_observed(), nullptr);
  EXPECT_EQ(*d.network().slave_count().if_observed(), 3);
}

TEST(Addressing, ReadsPastTheLastSlaveMeetNoSlave) {
  // Masters scan until nobody answers (esc-reference 14).
  const Decoded d =
      Decode("@slaves 2\n+1ms BRD 0x0000 11 00\n+1ms APRD 2:0x0000 00 00 wkc=0\n+1ms APRD 3:0x0110 00 00 wkc=0\n");
  EXPECT_EQ(d.slaves().size(), 0U);
  EXPECT_THAT(d.log->accesses, IsEmpty());
  ASSERT_EQ(d.log->answers.size(), 3U);
  EXPECT_EQ(d.log->answers[1].slave, kNoSlave);
  EXPECT_EQ(d.log->answers[1].wkc, 0);
}

TEST(Addressing, AStationWithoutAnswerIsNoSlave) {
  const Decoded d = Decode("+1ms FPRD 0x1001:0x0130 00 00 wkc=0\n+1ms FPRD 0x1001:0x0130 02 00 wkc=1\n");
  ASSERT_EQ(d.slaves().size(), 1U);
  EXPECT_EQ(*d.slaves()[0].station.if_observed(), 0x1001);
  EXPECT_EQ(d.slaves()[0].position.if_known(), nullptr) << "a running bus does not show positions";
  EXPECT_THAT(d.log->lines, ElementsAre("found 0", "state 0 ? -> 0x0002"));
}

TEST(Addressing, AddressZeroNamesNoSlave) {
  const Decoded d = Decode("+1ms FPRD 0:0x0130 02 00 wkc=3\n+1ms FPWR 0:0x0120 02 00 wkc=3\n");
  EXPECT_EQ(d.slaves().size(), 0U);
  EXPECT_THAT(d.log->accesses, IsEmpty());
}

TEST(Addressing, PositionOfASlaveThatWasMetByItsStation) {
  const Decoded d = Decode(R"(
@slaves 2
+1ms FPRD 0x1002:0x0130 02 00
+1ms BRD  0x0000 11 00
+1ms APRD 1:0x0010 02 10
)");
  ASSERT_EQ(d.slaves().size(), 1U);
  EXPECT_EQ(*d.slaves()[0].position.if_observed(), 1);
}

TEST(Addressing, RunningBusScannedAgain) {
  // SOEM starts again on a bus that was met by station addresses: everybody is met a second time, by position.
  const Decoded d = Decode(R"(
@slaves 2
+1ms FPRD 0x1001:0x0130 08 00
+1ms FPRD 0x1002:0x0130 08 00
+1ms BRD  0x0000 11 00
+1ms APRD 0:0x0140 05 0C
+1ms APWR 0:0x0010 01 10
+1ms APRD 1:0x0140 05 0C
+1ms APWR 1:0x0010 02 10
+1ms FPRD 0x1001:0x0130 01 00
+1ms BRD  0x0130 01 00
)");
  std::size_t counting = 0;
  for (SlaveId s = 0; s < d.slaves().size(); ++s) counting += d.slaves()[s].replaced ? 0U : 1U;
  EXPECT_EQ(counting, 2U);
  EXPECT_EQ(*d.slaves()[d.slaves().AtStation(0x1001)].position.if_known(), 0);
  EXPECT_EQ(*d.slaves()[d.slaves().AtStation(0x1002)].position.if_known(), 1);
  for (const std::string& line : d.log->Only("address")) EXPECT_EQ(line.find(" as "), std::string::npos) << line;
}

TEST(Addressing, BroadcastClearsAddresses) {
  const Decoded d = Decode("@slaves 3\n" + std::string(kScan) + R"(
+1ms BWR  0x0010   00 00
+1ms APWR 0:0x0010 02 10
+1ms APWR 1:0x0010 01 10
+1ms FPRD 0x1002:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
)");
  EXPECT_EQ(d.slaves().size(), 3U);
  EXPECT_EQ(d.slaves().AtStation(0x1002), 0);
  EXPECT_EQ(d.slaves().AtStation(0x1001), 1);
  EXPECT_EQ(d.slaves().AtStation(0x1003), kNoSlave);
  EXPECT_THAT(d.log->Only("state"), ElementsAre("state 1 ? -> 0x0001", "state 0 ? -> 0x0001"));
  for (const std::string& line : d.log->Only("address")) EXPECT_EQ(line.find(" as "), std::string::npos) << line;
}

TEST(Addressing, DuplicatesAreReported) {
  const Decoded d = Decode("@slaves 3\n" + std::string(kScan) + "+1ms APWR 2:0x0010 01 10\n");
  EXPECT_EQ(d.log->Only("address").back(), "address 2 = 0x1001 as 0");
}

TEST(Addressing, ASlaveThatLeftTheBusIsNoDuplicate) {
  // Two of three slaves are gone; the one that is left is given the address of one of those.
  const Decoded d =
      Decode("@slaves 3\n" + std::string(kScan) + "@slaves 1\n+1ms BRD 0x0000 11 00\n+1ms APWR 0:0x0010 03 10\n");
  EXPECT_EQ(d.slaves().AtPosition(0), 2) << "the one that has had this address";
  for (const std::string& line : d.log->Only("address")) EXPECT_EQ(line.find(" as "), std::string::npos) << line;
}

TEST(Addressing, RefusedAddressIsNotTaken) {
  const Decoded d = Decode("+1ms BRD 0x0000 11 00\n+1ms APRD 0:0x0130 01 00\n+1ms APWR 0:0x0010 01 10 wkc=0\n");
  EXPECT_THAT(d.log->Only("address"), IsEmpty());
  EXPECT_EQ(d.slaves().AtStation(0x1001), kNoSlave);
}

TEST(Addressing, AliasWorksOnlyWhenEnabled) {
  // IgH numbers stations from 1, and an alias may be 2: FPRD 2 is another slave unless 0x0103 bit 0 was set.
  const std::string scan = "@slaves 2\n+1ms BRD 0x0000 11 00\n+1ms APWR 0:0x0010 01 00\n+1ms FPRD 1:0x0012 02 00\n";
  const Decoded off = Decode(scan + "+1ms FPRD 2:0x0130 04 00\n");
  EXPECT_EQ(*off.slaves()[0].alias.if_observed(), 2);
  EXPECT_EQ(off.slaves().size(), 2U);
  EXPECT_THAT(off.log->Only("state"), ElementsAre("state 1 ? -> 0x0004"));

  const Decoded on = Decode(scan + "+1ms FPWR 1:0x0103 01\n+1ms FPRD 2:0x0130 04 00\n");
  EXPECT_EQ(on.slaves().size(), 1U);
  EXPECT_THAT(on.log->Only("state"), ElementsAre("state 0 ? -> 0x0004"));

  const Decoded again_off = Decode(scan + "+1ms FPWR 1:0x0103 01\n+1ms BWR 0x0103 00\n+1ms FPRD 2:0x0130 04 00\n");
  EXPECT_EQ(again_off.slaves().size(), 2U);
}

TEST(Addressing, WhatTwoSlavesAnswerIsTheStateOfNoSlave) {
  // Working counter 2 at one station: the data may come from either.
  const Decoded d = Decode(R"(
@slaves 2
+1ms BRD 0x0000 11 00
+1ms APWR 0:0x0010 01 10
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 04 00 wkc=2
)");
  EXPECT_THAT(d.log->Only("state"), ElementsAre("state 0 ? -> 0x0001"));
  EXPECT_EQ(d.log->answers.back().wkc, 2) << "the working counter itself is told";
}

TEST(Addressing, NeverMoreSlavesThanTheLimit) {
  Trace trace;
  for (std::uint32_t address = 1; address < 65536; address += 97) {
    auto& frame = trace.After(10);
    for (std::uint32_t k = 0; k < 97 && address + k < 65536; ++k) {
      frame.Fprd(static_cast<std::uint16_t>(address + k), 0x0130, {1, 0});
    }
  }
  const Decoded d = Decode(trace);
  EXPECT_EQ(d.slaves().size(), bus::SlaveSet::kMaxSlaves);
}

TEST(Addressing, PositionsFarBeyondAreNoSlave) {
  // A counter that claims 60,000 slaves is damaged or made up.
  const Decoded d = Decode("@slaves 60000\n+1ms BRD 0x0000 11 00\n+1ms APRD 50000:0x0130 01 00 wkc=1\n");
  EXPECT_EQ(d.network().slave_count().if_known(), nullptr);
  EXPECT_EQ(d.slaves().size(), 0U);
}

}  // namespace
}  // namespace ecaudit::track::test
