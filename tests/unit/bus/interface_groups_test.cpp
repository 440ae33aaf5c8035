// Several interfaces in one capture: one bus, or more than one.
#include "decoder/bus/interface_groups.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

std::string PollsOf(int count, int first, const std::string& every = "+1ms") {
  std::string lines;
  for (int i = 0; i < count; ++i) {
    lines += every + " FPRD 0x1001:0x0130 08 00 idx=" + std::to_string((first + i) % 256) + "\n";
  }
  return lines;
}

/// What was captured at one bus, `ns` later, on that interface.
std::vector<Packet> At(std::uint16_t interface, const std::string& lines, TimeNs ns = 0) {
  Result<Trace> trace = Trace::Parse(lines);
  EXPECT_TRUE(trace);
  std::vector<Packet> packets = trace->Packets();
  for (Packet& packet : packets) {
    packet.interface_index = interface;
    packet.time += ns;
  }
  return packets;
}

std::vector<Packet> Together(std::vector<Packet> a, const std::vector<Packet>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::stable_sort(a.begin(), a.end(), [](const Packet& x, const Packet& y) { return x.time < y.time; });
  return a;
}

const std::string kSecondMaster = "@mac 10:10:10:10:10:10\n";

TEST(InterfaceGroups, TwoMastersOnTwoInterfacesHaveABusEach) {
  const PairingStatistics read =
      StatisticsOf(Together(At(0, PollsOf(300, 0)), At(1, kSecondMaster + PollsOf(200, 7), 300'000)));
  EXPECT_EQ(read.other_bus, 400U);
  EXPECT_EQ(read.other_bus_interface, 1U);
  EXPECT_EQ(read.foreign, 400U);
  EXPECT_EQ(read.paired, 300U);
  EXPECT_EQ(read.lost, 0U);
}

TEST(InterfaceGroups, TheBusOfWhichMostIsSeenAtTheBeginningIsEvaluated) {
  const PairingStatistics read =
      StatisticsOf(Together(At(0, kSecondMaster + PollsOf(30, 7, "+3ms")), At(1, PollsOf(300, 0), 300'000)));
  EXPECT_EQ(read.other_bus_interface, 0U);
  EXPECT_EQ(read.paired, 300U);
}

/// SOEM has the same address everywhere.
TEST(InterfaceGroups, AreDistinguishedAlsoWhereBothMastersHaveOneAddress) {
  const PairingStatistics read = StatisticsOf(Together(At(0, PollsOf(300, 0)), At(1, PollsOf(200, 0), 450'000)));
  EXPECT_EQ(read.other_bus, 400U);
  EXPECT_EQ(read.paired, 300U);
}

TEST(InterfaceGroups, ABusThatIsSeenLaterIsAnotherOne) {
  for (const std::string& master : {kSecondMaster, std::string()}) {
    const PairingStatistics read =
        StatisticsOf(Together(At(0, PollsOf(600, 0)), At(1, master + PollsOf(50, 7), 400'450'000)));
    EXPECT_EQ(read.other_bus, 100U) << master;
    EXPECT_EQ(read.paired, 600U);
  }
}

/// The first frames of the second one are among those by which the busses are told apart.
TEST(InterfaceGroups, ABusThatHasJustBegunIsAnotherOne) {
  const PairingStatistics read =
      StatisticsOf(Together(At(0, PollsOf(600, 0)), At(1, kSecondMaster + PollsOf(50, 7), 125'450'000)));
  EXPECT_EQ(read.other_bus, 100U);
  EXPECT_EQ(read.paired, 600U);
}

/// Recordings put behind each other describe their interface anew, each in a section of its own.
TEST(InterfaceGroups, TheNextRecordingOfABusIsNoOtherBus) {
  std::vector<Packet> packets = At(0, PollsOf(600, 0));
  for (std::size_t i = 800; i < packets.size(); ++i) packets[i].interface_index = 1;
  capture::CaptureInfo info;
  info.interfaces.resize(2);
  EXPECT_EQ(StatisticsOf(packets, info).other_bus, 400U) << "in one section it is at another bus";
  info.interfaces[1].section = 1;
  const PairingStatistics read = StatisticsOf(packets, info);
  EXPECT_EQ(read.other_bus, 0U);
  EXPECT_EQ(read.paired, 600U);
}

TEST(InterfaceGroups, ATapIsOneBus) {
  Result<Trace> trace = Trace::Parse("@two-interfaces\n" + PollsOf(300, 0));
  ASSERT_TRUE(trace);
  const PairingStatistics read = StatisticsOf(trace->Packets());
  EXPECT_EQ(read.other_bus, 0U);
  EXPECT_EQ(read.paired, 300U);
}

/// A bridge shows each packet on both of its interfaces, also where the second one is captured from later on.
TEST(InterfaceGroups, ABridgeIsOneBus) {
  for (const std::size_t from : {std::size_t{0}, std::size_t{800}}) {
    std::vector<Packet> behind = At(1, PollsOf(600, 0), 5'000);
    behind.erase(behind.begin(), behind.begin() + static_cast<std::ptrdiff_t>(from));
    const PairingStatistics read = StatisticsOf(Together(At(0, PollsOf(600, 0)), behind));
    EXPECT_EQ(read.other_bus, 0U) << from;
    EXPECT_EQ(read.paired, 600U) << from;
  }
}

/// Both ends of a redundant line that is broken send the same at once, and each slave is reached from one of them.
TEST(InterfaceGroups, ABrokenLineIsOneBus) {
  std::string main;
  std::string other = kSecondMaster;
  for (int i = 0; i < 300; ++i) {
    const std::string index = " idx=" + std::to_string(i % 256);
    const bool near = i % 2 == 0;
    const std::string station = near ? "0x1001" : "0x1002";
    main += "+1ms FPRD " + station + ":0x0130 08 00" + index + (near ? "\n" : " wkc=0\n");
    other += "+1ms FPRD " + station + ":0x0130 08 00" + index + (near ? " wkc=0\n" : "\n");
  }
  EXPECT_EQ(StatisticsOf(Together(At(0, main), At(1, other, 2'000))).other_bus, 0U);
}

TEST(InterfaceGroups, TwoMastersInStepHaveABusEachAllTheSame) {
  const PairingStatistics read =
      StatisticsOf(Together(At(0, PollsOf(300, 0)), At(1, kSecondMaster + PollsOf(300, 0), 2'000)));
  EXPECT_EQ(read.other_bus, 600U);
  EXPECT_EQ(read.paired, 300U);
}

TEST(InterfaceGroups, FramesWithoutAnswerAreNoBus) {
  const PairingStatistics read =
      StatisticsOf(Together(At(0, PollsOf(300, 0)), At(1, kSecondMaster + "@out-only\n" + PollsOf(200, 7), 300'000)));
  EXPECT_EQ(read.other_bus, 0U);
  EXPECT_EQ(read.paired, 300U);
}

}  // namespace
}  // namespace ecaudit::bus::test
