// Distributed clocks and cycles of real and lab captures. Expected values were read from the datagrams by hand (tshark,
// a calculator) or stand in the captures' truth files.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/sync/sync_test_support.h"

namespace ecaudit::test {
namespace {

constexpr double kExact = 1e-6;

const DcSummary& Dc(const AnalysisResult& result, std::size_t position) {
  static const DcSummary kNothing;
  return position < result.slaves.size() && result.slaves[position].dc ? *result.slaves[position].dc : kNothing;
}

// Frames 502-526 measure and set delays and offsets, 3022-3054 check and switch SYNC0 on; 257 LRW carry FRMW 0x0910.
TEST(SyncCaptures, ReplayDc) {
  const auto packets = LoadPackets("real/replay-dc.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  const AnalysisResult result = AnalysePackets(packets);
  ASSERT_EQ(result.slaves.size(), 3U);

  const DcSummary& coupler = Dc(result, 0);
  EXPECT_TRUE(coupler.reference);
  EXPECT_EQ(coupler.receive_times_ns[0], 0x3C620F52U);
  EXPECT_EQ(coupler.receive_times_ns[1], 0x3C6211AAU);
  EXPECT_EQ(coupler.receive_time_core_ns, 0xF53C620F52U);
  EXPECT_EQ(coupler.offset_ns, -0xF53C620F52);
  EXPECT_EQ(coupler.delay_ns, 0U);
  EXPECT_EQ(coupler.difference_last_ns, 0U);

  // Receive times only: 0x0918, 0x0920 and 0x092C answer with a working counter of 0.
  const DcSummary& second = Dc(result, 1);
  EXPECT_EQ(second.receive_times_ns[0], 0x3D0BD6AEU);
  EXPECT_FALSE(second.offset_ns);
  EXPECT_FALSE(second.activated.seen());
  ASSERT_FALSE(second.configuration.empty());
  EXPECT_TRUE(second.configuration.front().refused);

  const DcSummary& third = Dc(result, 2);
  EXPECT_FALSE(third.reference);
  EXPECT_EQ(third.offset_ns, -0xF53C8065EC);
  EXPECT_EQ(third.delay_ns, 300U);
  EXPECT_EQ(third.difference_reads, 1U);
  EXPECT_EQ(third.difference_last_ns, 253U);
  EXPECT_EQ(third.activated.number, 3054U);
  EXPECT_EQ(third.activated_with, 3);
  EXPECT_EQ(third.start_time_ns, 470'000'000U);
  EXPECT_EQ(third.sync0_cycle_ns, 5'000'000U);
  EXPECT_EQ(third.sync1_cycle_ns, 0U);
  // Offset, delay, SYNC off, start, both cycles, SYNC0 on.
  std::vector<EscAddress> order;
  for (const DcStep& step : third.configuration) order.push_back(step.address);
  EXPECT_EQ(order, (std::vector<EscAddress>{0x0920, 0x0928, 0x0981, 0x0990, 0x09A0, 0x0981}));

  EXPECT_EQ(result.bus.dc.distributions, 357U);
  EXPECT_EQ(result.bus.dc.first.number, 528U);
  EXPECT_EQ(result.bus.dc.last.number, 3580U);

  const CycleSummary& cycle = result.bus.cycle;
  EXPECT_EQ(cycle.time_source, "dc");
  EXPECT_EQ(cycle.command, "LRW");
  EXPECT_EQ(cycle.cycles, 256U);
  EXPECT_NEAR(cycle.mean_us, 5085.09234375, kExact);
  EXPECT_NEAR(cycle.min_us, 264.44, kExact);
  EXPECT_NEAR(cycle.max_us, 10091.4, kExact);
  EXPECT_NEAR(cycle.stddev_us, 805.9687220863514, kExact);
  EXPECT_NEAR(cycle.median_us, 5154.68, 5154.68 * 0.002);
  // Frame 3356 at 1100616800 ns, 3358 at 1110708200 ns.
  EXPECT_EQ(cycle.longest_from.number, 3355U);
  EXPECT_EQ(cycle.longest_to.number, 3357U);

  ASSERT_TRUE(third.phase);
  EXPECT_EQ(third.phase->cycle_ns, 5'000'000U);
}

// The truth file: offsets 29229, 6458 and 67954 ns, delays 0, 300 and 600 ns, SYNC0 1 ms, no cycle missing.
TEST(SyncCaptures, LabDc) {
  const auto packets = LoadPackets("lab/dc.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  const AnalysisResult result = AnalysePackets(packets);
  ASSERT_EQ(result.slaves.size(), 3U);
  EXPECT_EQ(Dc(result, 0).offset_ns, 29229);
  EXPECT_EQ(Dc(result, 1).offset_ns, 6458);
  EXPECT_EQ(Dc(result, 2).offset_ns, 67954);
  EXPECT_FALSE(Dc(result, 0).delay_ns);  // the master writes none to the reference
  EXPECT_EQ(Dc(result, 1).delay_ns, 300U);
  EXPECT_EQ(Dc(result, 2).delay_ns, 600U);
  EXPECT_EQ(result.bus.dc.distributions, 5748U);  // 500 FRMW, 100 ARMW, one a cycle
  for (std::size_t s = 0; s < 3; ++s) {
    SCOPED_TRACE(s);
    EXPECT_EQ(Dc(result, s).sync0_cycle_ns, 1'000'000U);
    EXPECT_EQ(Dc(result, s).start_time_ns, s == 0 ? 848546483558000000U : 848546483559000000U);
    EXPECT_EQ(Dc(result, s).activation, 0);  // switched off at the end
    ASSERT_TRUE(Dc(result, s).phase);
    const SyncPhase& phase = *Dc(result, s).phase;
    EXPECT_EQ(phase.empty_intervals, 0U);
    EXPECT_EQ(phase.double_intervals, 0U);
    // Frame 11498 at ...487925960670 ns is the latest in its interval, 183 bytes and 4 of FCS long.
    EXPECT_NEAR(phase.max_us, 960.670 + 187 * 0.08 + 0.3 * static_cast<double>(s), kExact);
    EXPECT_EQ(phase.margin_frame.number, 11497U);
  }
  EXPECT_EQ(result.bus.cycle.time_source, "dc");
  EXPECT_EQ(result.bus.cycle.cycles, 5147U);
  EXPECT_NEAR(result.bus.cycle.mean_us, 1000.1047359626962, kExact);
  EXPECT_NEAR(result.bus.cycle.min_us, 519.302, kExact);
  EXPECT_NEAR(result.bus.cycle.max_us, 1425.591, kExact);
  EXPECT_EQ(result.bus.cycle.missing, 0U);
}

// The time in the frames does not depend on the stamps of the capture.
TEST(SyncCaptures, DcTimeNeedsNoStamps) {
  auto packets = LoadPackets("lab/dc.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  const AnalysisResult whole = AnalysePackets(packets);
  std::uint64_t random = 1;
  for (Packet& packet : packets) {
    random = random * 6364136223846793005U + 1442695040888963407U;
    packet.time = static_cast<TimeNs>(random >> 2U);
  }
  const AnalysisResult garbage = AnalysePackets(packets);
  EXPECT_EQ(garbage.bus.cycle.time_source, "dc");
  EXPECT_EQ(garbage.bus.cycle.cycles, whole.bus.cycle.cycles);
  EXPECT_EQ(garbage.bus.cycle.stddev_us, whole.bus.cycle.stddev_us);
  EXPECT_EQ(garbage.bus.cycle.max_us, whole.bus.cycle.max_us);
  ASSERT_TRUE(Dc(garbage, 2).phase);
  EXPECT_EQ(Dc(garbage, 2).phase->mean_us, Dc(whole, 2).phase->mean_us);
  EXPECT_EQ(Dc(garbage, 2).phase->histogram, Dc(whole, 2).phase->histogram);
}

// Eight cycles skipped at once and one later, by the truth file; stamps only.
TEST(SyncCaptures, LabJitter) {
  const auto packets = LoadPackets("lab/jitter.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  const CycleSummary cycle = AnalysePackets(packets).bus.cycle;
  EXPECT_EQ(cycle.time_source, "capture");
  EXPECT_EQ(cycle.missing, 8U + 1U + 1U);  // and the cycle that was 900 us late
  EXPECT_NEAR(cycle.max_us, 9007.0, 0.1);
  EXPECT_EQ(cycle.longest_from.number, 8791U);
  EXPECT_EQ(cycle.longest_to.number, 8793U);
  EXPECT_NEAR(cycle.median_us, 999.8, 2.0);
  EXPECT_EQ(cycle.bursts, 1U);  // 99 us behind the one that was 900 us late
}

TEST(SyncCaptures, WithoutDistributedClocksNothingIsSaidOfThem) {
  const auto packets = LoadPackets("lab/jitter.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  const AnalysisResult result = AnalysePackets(packets);
  EXPECT_EQ(result.bus.dc.samples, 0U);
  for (const SlaveSummary& slave : result.slaves) EXPECT_FALSE(slave.dc);
}

}  // namespace
}  // namespace ecaudit::test
