#include "decoder/bus/slave_set.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::bus {
namespace {

TEST(SlaveSet, KnowsNoSlaveAtFirst) {
  const SlaveSet slaves;
  EXPECT_EQ(slaves.size(), 0U);
  EXPECT_EQ(slaves.AtPosition(0), kNoSlave);
  EXPECT_EQ(slaves.AtStation(0x1001), kNoSlave);
  EXPECT_EQ(slaves.AtStation(0), kNoSlave);
}

TEST(SlaveSet, EveryStationAddressHasItsOwnSlave) {
  SlaveSet slaves;
  const std::vector<StationAddress> addresses{0x0000, 0x00FF, 0x0100, 0x1001, 0x1002, 0x10FF, 0x1100, 0xFF00, 0xFFFF};
  for (const StationAddress address : addresses) slaves.AddAtStation(address, 1);
  for (std::size_t i = 0; i < addresses.size(); ++i) EXPECT_EQ(slaves.AtStation(addresses[i]), i);
  const std::vector<StationAddress> others{0x0001, 0x1000, 0x1003, 0x2001, 0xFFFE};
  for (const StationAddress address : others) EXPECT_EQ(slaves.AtStation(address), kNoSlave);
  slaves.ClearStations(2);
  for (const StationAddress address : addresses) EXPECT_EQ(slaves.AtStation(address), kNoSlave);
}

TEST(SlaveSet, ASlaveIsAddedOnce) {
  SlaveSet slaves;
  const SlaveId first = slaves.AddAtPosition(3, 10);
  EXPECT_EQ(slaves.AddAtPosition(3, 11), first);
  const SlaveId second = slaves.AddAtStation(0x1001, 12);
  EXPECT_NE(second, first);
  EXPECT_EQ(slaves.AddAtStation(0x1001, 13), second);
  EXPECT_EQ(slaves.size(), 2U);
  EXPECT_EQ(slaves.AtPosition(3), first);
  EXPECT_EQ(slaves.AtPosition(2), kNoSlave);
  EXPECT_EQ(*slaves[first].position.if_observed(), 3);
  EXPECT_EQ(slaves[first].position.since(), 10U);
  EXPECT_EQ(slaves[second].position.if_known(), nullptr);
}

TEST(SlaveSet, MetByStationThenItsPositionShows) {
  SlaveSet slaves;
  const SlaveId met = slaves.AddAtStation(0x1001, 1);
  const Assignment assigned = slaves.AssignAtPosition(0, 0x1001, 2);
  EXPECT_EQ(assigned.slave, met);
  EXPECT_EQ(assigned.other, kNoSlave);
  EXPECT_EQ(slaves.size(), 1U);
  EXPECT_EQ(slaves.AtPosition(0), met);
}

TEST(SlaveSet, MetByStationAndByPositionTurnsOutToBeOne) {
  // A running bus is scanned anew: position 0 is met first, then takes the address that somebody had.
  SlaveSet slaves;
  const SlaveId by_station = slaves.AddAtStation(0x1001, 1);
  const SlaveId by_position = slaves.AddAtPosition(0, 2);
  const Assignment assigned = slaves.AssignAtPosition(0, 0x1001, 3);
  EXPECT_EQ(assigned.slave, by_position);
  EXPECT_EQ(assigned.other, kNoSlave) << "no duplicate: it was this slave, or one whose place nobody knows";
  EXPECT_EQ(slaves.AtStation(0x1001), by_position);
  EXPECT_TRUE(slaves[by_station].replaced);
  EXPECT_FALSE(slaves[by_position].replaced);
}

TEST(SlaveSet, TwoPositionsWithOneAddress) {
  SlaveSet slaves;
  const SlaveId a = slaves.AssignAtPosition(0, 0x1001, 1).slave;
  const Assignment second = slaves.AssignAtPosition(1, 0x1001, 2);
  EXPECT_NE(second.slave, a);
  EXPECT_EQ(second.other, a);
}

TEST(SlaveSet, ASharedAddressStaysWithWhoKeepsIt) {
  // Renumbering may give an address out twice for a moment (esc-reference 14, 9).
  SlaveSet slaves;
  const SlaveId a = slaves.AssignAtPosition(0, 0x1001, 1).slave;
  const SlaveId b = slaves.AssignAtPosition(1, 0x1001, 2).slave;
  slaves.AssignAtPosition(1, 0x1002, 3);
  EXPECT_EQ(slaves.AtStation(0x1002), b);
  EXPECT_EQ(slaves.AtStation(0x1001), a);
}

TEST(SlaveSet, Swapping) {
  SlaveSet slaves;
  const SlaveId a = slaves.AssignAtPosition(0, 0x1002, 1).slave;
  const SlaveId b = slaves.AssignAtPosition(1, 0x1001, 2).slave;
  EXPECT_EQ(slaves.AssignAtPosition(0, 0x1001, 3).other, b);
  EXPECT_EQ(slaves.AssignAtPosition(1, 0x1002, 4).other, kNoSlave);
  EXPECT_EQ(slaves.AtStation(0x1001), a);
  EXPECT_EQ(slaves.AtStation(0x1002), b);
}

TEST(SlaveSet, ClearedAddressesNameNoSlave) {
  SlaveSet slaves;
  const SlaveId a = slaves.AssignAtPosition(0, 0x1001, 1).slave;
  slaves.ClearStations(5);
  EXPECT_EQ(slaves.AtStation(0x1001), kNoSlave);
  EXPECT_FALSE(slaves[a].station_valid);
  EXPECT_EQ(*slaves[a].station.if_known(), 0x1001) << "stays as last known, for reports";
  EXPECT_EQ(slaves.AtPosition(0), a);
  // Given out anew in another order: no duplicates.
  const SlaveId b = slaves.AssignAtPosition(1, 0x1001, 6).slave;
  EXPECT_NE(b, a);
  EXPECT_EQ(slaves.AssignAtPosition(0, 0x1002, 7).other, kNoSlave);
  EXPECT_EQ(slaves.AtStation(0x1001), b);
}

TEST(SlaveSet, AddressZeroIsNoDuplicate) {
  SlaveSet slaves;
  EXPECT_EQ(slaves.AssignAtPosition(0, 0, 1).other, kNoSlave);
  EXPECT_EQ(slaves.AssignAtPosition(1, 0, 2).other, kNoSlave);
  EXPECT_EQ(slaves.AtStation(0), kNoSlave);
}

TEST(SlaveSet, AnAliasCountsOnlyWhereTheMasterEnabledIt) {
  // 0x0012 answers only while bit 24 of DL control is set (esc-reference 2.1); it is clear after power-on.
  SlaveSet slaves;
  const SlaveId a = slaves.AssignAtPosition(0, 0x0001, 1).slave;
  slaves.LearnAlias(a, 0x0002, 2);
  EXPECT_EQ(*slaves[a].alias.if_observed(), 2);
  EXPECT_EQ(slaves.AtStation(0x0002), kNoSlave);
  slaves.EnableAlias(a, true);
  EXPECT_EQ(slaves.AtStation(0x0002), a);
  const SlaveId b = slaves.AssignAtPosition(1, 0x0002, 3).slave;
  EXPECT_EQ(slaves.AtStation(0x0002), b) << "a station address goes first";
  slaves.EnableAlias(a, false);
  slaves.ClearStations(4);
  EXPECT_EQ(slaves.AtStation(0x0002), kNoSlave);
}

TEST(SlaveSet, AliasZeroNamesNoSlave) {
  SlaveSet slaves;
  const SlaveId a = slaves.AddAtPosition(0, 1);
  slaves.LearnAlias(a, 0, 2);
  slaves.EnableAlias(a, true);
  EXPECT_EQ(slaves.AtStation(0), kNoSlave);
}

TEST(SlaveSet, IsBounded) {
  SlaveSet slaves;
  for (std::uint32_t p = 0; p < 65536; ++p) slaves.AddAtPosition(static_cast<SlavePos>(p), 1);
  EXPECT_EQ(slaves.size(), SlaveSet::kMaxSlaves);
  for (std::uint32_t a = 0; a < 65536; ++a) {
    slaves.AddAtStation(static_cast<StationAddress>(a), 2);
    slaves.AssignAtPosition(static_cast<SlavePos>(a), static_cast<StationAddress>(a), 3);
  }
  EXPECT_EQ(slaves.size(), SlaveSet::kMaxSlaves);
}

TEST(SlaveSet, SlavesMetByStationTakeTheFreePlacesInOrderOfTheirAddresses) {
  SlaveSet slaves;
  const SlaveId high = slaves.AddAtStation(0x1003, 1);
  const SlaveId low = slaves.AddAtStation(0x1001, 2);
  const SlaveId placed = slaves.AssignAtPosition(1, 0x2000, 3).slave;
  EXPECT_TRUE(slaves.PlaceByStation(3, 4));
  EXPECT_EQ(slaves.AtPosition(0), low);
  EXPECT_EQ(slaves.AtPosition(1), placed);
  EXPECT_EQ(slaves.AtPosition(2), high);
  // The order is a habit of masters, and nothing that was seen.
  EXPECT_EQ(slaves[low].position.if_observed(), nullptr);
  EXPECT_EQ(*slaves[low].position.if_known(), 0);
  EXPECT_EQ(*slaves[placed].position.if_observed(), 1);
  EXPECT_FALSE(slaves.PlaceByStation(3, 5)) << "nobody is left";
}

TEST(SlaveSet, NoSlaveIsPlacedBeforeAllAreMet) {
  SlaveSet slaves;
  const SlaveId one = slaves.AddAtStation(0x1001, 1);
  slaves.AddAtStation(0x1002, 2);
  EXPECT_FALSE(slaves.PlaceByStation(3, 3)) << "the third may have any address";
  EXPECT_EQ(slaves[one].position.if_known(), nullptr);
  slaves.AddAtStation(0x1000, 4);
  EXPECT_TRUE(slaves.PlaceByStation(3, 5));
  EXPECT_EQ(slaves.AtPosition(1), one);
}

TEST(SlaveSet, MoreSlavesThanCountedAreNotPlaced) {
  SlaveSet slaves;
  slaves.AddAtStation(0x1001, 1);
  slaves.AddAtStation(0x1002, 2);
  EXPECT_FALSE(slaves.PlaceByStation(1, 3));
  EXPECT_EQ(slaves.AtPosition(0), kNoSlave);
}

TEST(SlaveSet, WhoWasMetAtAPlaceWithoutItsAddressIsTheSlaveThatIsPlacedThere) {
  // ARMW to position 0, and FPWR to 0x1001: one slave.
  SlaveSet slaves;
  const SlaveId nameless = slaves.AddAtPosition(0, 1);
  const SlaveId by_station = slaves.AddAtStation(0x1001, 2);
  EXPECT_TRUE(slaves.PlaceByStation(1, 3));
  EXPECT_TRUE(slaves[nameless].replaced);
  EXPECT_EQ(slaves[nameless].successor, by_station);
  EXPECT_FALSE(slaves[by_station].replaced);
  EXPECT_EQ(slaves.AtPosition(0), by_station);
  EXPECT_EQ(slaves.AtStation(0x1001), by_station);
}

}  // namespace
}  // namespace ecaudit::bus
