// Clocks of the two interfaces of a tap: how far they are apart, and packets as one clock would have stamped them.
#include "decoder/bus/interface_clocks.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/bus/aligned_source.h"
#include "tests/support/memory_source.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::bus {
namespace {

using capture::CapturedFrame;
using capture::CaptureInfo;
using capture::ReadStatus;
using ecaudit::test::MemorySource;
using ecaudit::test::Packet;
using ecaudit::test::Trace;
using ::testing::ElementsAre;

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kRoundTrip = 30'000;  // of a trace

enum class Order { kOfTheWire, kOfStamps };

/// What a tap writes whose clock of the returns is `ahead` later at the beginning, and runs `ppm` faster.
std::vector<Packet> Tapped(const std::string& lines, TimeNs ahead, Order order, std::int64_t ppm = 0) {
  Result<Trace> trace = Trace::Parse("@two-interfaces\n" + lines);
  EXPECT_TRUE(trace);
  std::vector<Packet> packets = trace->Packets();
  const TimeNs start = packets.front().time;
  for (Packet& packet : packets) {
    if (packet.interface_index == 1) packet.time += ahead + (packet.time - start) / 1'000'000 * ppm;
  }
  if (order == Order::kOfStamps) {
    std::stable_sort(packets.begin(), packets.end(), [](const Packet& a, const Packet& b) { return a.time < b.time; });
  }
  return packets;
}

std::string Polls(int count, const std::string& every = "+1ms", int round = 200) {
  std::string lines;
  for (int i = 0; i < count; ++i) {
    lines += every + " FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i % round) + "\n";
  }
  return lines;
}

std::optional<ClocksApart> ComparedIn(const std::vector<Packet>& packets) {
  MemorySource source(packets);
  return CompareClocks(source);
}

std::unique_ptr<capture::FrameSource> Aligned(const std::vector<Packet>& packets, const CaptureInfo& info = {}) {
  auto source = OpenAligned([&]() -> Result<std::unique_ptr<capture::FrameSource>> {
    return std::unique_ptr<capture::FrameSource>(std::make_unique<MemorySource>(packets, info));
  });
  EXPECT_TRUE(source);
  return std::move(*source);
}

struct Stamped {
  FrameNo number = 0;
  std::uint16_t interface = 0;
  TimeNs time = 0;
};

std::vector<Stamped> AllOf(capture::FrameSource& source) {
  std::vector<Stamped> all;
  CapturedFrame frame;
  while (source.Next(frame) == ReadStatus::kFrame) all.push_back({frame.number, frame.interface_index, frame.time});
  return all;
}

/// Each return right behind its frame, within a round trip and numbered in this order.
void ExpectOneClock(const std::vector<Stamped>& all, std::size_t frames) {
  ASSERT_EQ(all.size(), 2 * frames);
  for (std::size_t i = 0; i < all.size(); i += 2) {
    ASSERT_EQ(all[i].interface, 0U) << i;
    ASSERT_EQ(all[i + 1].interface, 1U) << i;
    ASSERT_EQ(all[i].number, i + 1);
    ASSERT_EQ(all[i + 1].number, i + 2);
    ASSERT_GT(all[i + 1].time, all[i].time) << i;
    ASSERT_LE(all[i + 1].time, all[i].time + kRoundTrip) << i;
  }
}

TEST(InterfaceClocks, ShowHowFarTheyAreApart) {
  for (const TimeNs ahead : {2 * kMs, -2 * kMs, 3'600'000 * kMs, -37'000 * kMs}) {
    const auto apart = ComparedIn(Tapped(Polls(100), ahead, Order::kOfTheWire));
    ASSERT_TRUE(apart) << ahead;
    EXPECT_EQ(apart->outbound, 0U);
    EXPECT_EQ(apart->returned, 1U);
    EXPECT_GE(apart->ahead_ns, ahead) << "no return comes before its frame";
    EXPECT_LE(apart->ahead_ns, ahead + kRoundTrip);
    EXPECT_EQ(apart->pairs, 100U);
    EXPECT_TRUE(apart->in_order);
  }
}

TEST(InterfaceClocks, AreComparedAlsoWherePacketsAreSortedByThem) {
  for (const TimeNs ahead : {40 * kMs, -40 * kMs, 3'600'000 * kMs}) {
    const auto apart = ComparedIn(Tapped(Polls(100), ahead, Order::kOfStamps));
    ASSERT_TRUE(apart) << ahead;
    EXPECT_GE(apart->ahead_ns, ahead);
    EXPECT_LE(apart->ahead_ns, ahead + kRoundTrip);
    EXPECT_FALSE(apart->in_order);
  }
}

TEST(InterfaceClocks, OfTheReturnsMayComeFirst) {
  std::vector<Packet> packets = Tapped(Polls(100), 5 * kMs, Order::kOfTheWire);
  for (Packet& packet : packets) packet.interface_index = packet.interface_index == 0 ? 1 : 0;
  const auto apart = ComparedIn(packets);
  ASSERT_TRUE(apart);
  EXPECT_EQ(apart->outbound, 1U);
  EXPECT_EQ(apart->returned, 0U);
}

TEST(InterfaceClocks, ThatMayBeOneClockAreNotApart) {
  EXPECT_FALSE(ComparedIn(Tapped(Polls(100), 0, Order::kOfTheWire)));
  EXPECT_FALSE(ComparedIn(Tapped(Polls(100), kMs / 2, Order::kOfTheWire)));
  // A slow line: the master waits for each frame.
  EXPECT_FALSE(ComparedIn(Tapped("@rtt 3ms\n" + Polls(100, "+10ms"), 0, Order::kOfTheWire)));
}

TEST(InterfaceClocks, AreNotComparedWhereFramesDoNotShow) {
  EXPECT_FALSE(ComparedIn(Tapped(Polls(6), 5 * kMs, Order::kOfTheWire))) << "too few";
  EXPECT_FALSE(ComparedIn(Tapped("@no-time\n" + Polls(100), 0, Order::kOfTheWire))) << "no stamps";
  std::vector<Packet> both = Tapped(Polls(100), 0, Order::kOfTheWire);
  for (std::size_t i = 0; i < both.size(); ++i) both[i].interface_index = i % 4 < 2 ? 0 : 1;
  EXPECT_FALSE(ComparedIn(both)) << "each interface has both copies";
  std::vector<Packet> three = Tapped(Polls(100), 5 * kMs, Order::kOfTheWire);
  for (std::size_t i = 0; i < three.size(); ++i) three[i].interface_index = static_cast<std::uint16_t>(i % 3);
  EXPECT_FALSE(ComparedIn(three)) << "three interfaces";
}

/// Where one index serves for all, only the order of the file tells which frame came back.
TEST(InterfaceClocks, AreComparedByOrderWhereAllFramesAreAlike) {
  const auto apart = ComparedIn(Tapped(Polls(100, "+1ms", 1), 7'300'000, Order::kOfTheWire));
  ASSERT_TRUE(apart);
  EXPECT_GE(apart->ahead_ns, 7'300'000);
  EXPECT_LE(apart->ahead_ns, 7'300'000 + kRoundTrip);
}

TEST(AlignedSource, MovesStampsAndKeepsTheOrder) {
  const auto source = Aligned(Tapped(Polls(1000), 5 * kMs, Order::kOfTheWire, 100));
  ASSERT_TRUE(source->info().clock_shift);
  EXPECT_EQ(source->info().clock_shift->interface, 1U);
  EXPECT_EQ(source->info().clock_shift->reference, 0U);
  EXPECT_FALSE(source->info().clock_shift->renumbered);
  ExpectOneClock(AllOf(*source), 1000);
}

TEST(AlignedSource, PutsPacketsIntoTheOrderOfTheWire) {
  for (const TimeNs ahead : {-40 * kMs, 40 * kMs, 3'600'000 * kMs}) {
    const auto source = Aligned(Tapped(Polls(1000), ahead, Order::kOfStamps, -100));
    ASSERT_TRUE(source->info().clock_shift) << ahead;
    EXPECT_TRUE(source->info().clock_shift->renumbered);
    ExpectOneClock(AllOf(*source), 1000);
    EXPECT_EQ(source->info().packets, 2000U);
  }
}

TEST(AlignedSource, FollowsClocksThatRanApartInAPause) {
  const auto source = Aligned(Tapped(Polls(100) + "+2000s" + Polls(100).substr(4), 5 * kMs, Order::kOfTheWire, 50));
  ExpectOneClock(AllOf(*source), 200);
}

TEST(AlignedSource, LostFramesDoNotLeadItAstray) {
  std::string lines;
  for (int i = 0; i < 600; ++i) {
    lines += "+1ms FPRD 0x1001:0x0130 08 00 idx=" + std::to_string(i % 16) + (i % 50 == 49 ? " @lost\n" : "\n");
  }
  for (const Order order : {Order::kOfTheWire, Order::kOfStamps}) {
    const auto source = Aligned(Tapped(lines, 40 * kMs, order));
    TimeNs sent = 0;
    for (const Stamped& packet : AllOf(*source)) {
      if (packet.interface == 1) {
        EXPECT_GT(packet.time, sent) << packet.number;
        EXPECT_LE(packet.time, sent + kRoundTrip) << packet.number;
      } else {
        sent = packet.time;
      }
    }
  }
}

TEST(AlignedSource, ReportsWhatTheFileHolds) {
  CaptureInfo info;
  info.path = "tap.pcapng";
  info.damage = capture::Damage{"file ends inside packet 201", 4711, 200};
  // Sorted, the frames stand in front: packet 101 is the first return, the second packet on the wire.
  info.comments = {{0, "of the file"}, {1, "first frame"}, {101, "first return"}};
  const auto source = Aligned(Tapped(Polls(100), 3'600'000 * kMs, Order::kOfStamps), info);
  CapturedFrame frame;
  ReadStatus status = ReadStatus::kFrame;
  while (status == ReadStatus::kFrame) status = source->Next(frame);
  EXPECT_EQ(status, ReadStatus::kDamaged);
  ASSERT_TRUE(source->info().damage);
  EXPECT_EQ(source->info().damage->message, "file ends inside packet 201");
  EXPECT_EQ(source->info().damage->after_frame, 200U);
  std::vector<std::string> comments;
  for (const capture::Comment& c : source->info().comments) comments.push_back(std::to_string(c.frame) + " " + c.text);
  EXPECT_THAT(comments, ElementsAre("0 of the file", "1 first frame", "2 first return"));
}

TEST(AlignedSource, LeavesOneClockAlone) {
  const auto source = Aligned(Tapped(Polls(100), 0, Order::kOfTheWire));
  EXPECT_FALSE(source->info().clock_shift);
  EXPECT_EQ(AllOf(*source).size(), 200U);
}

}  // namespace
}  // namespace ecaudit::bus
