#include "decoder/esc/dc_registers.h"

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

TEST(DcTime, EpochIsTheYear2000) {
  EXPECT_EQ(DcToUnixTime(0), 946684800LL * 1000000000);
  EXPECT_EQ(DcToUnixTime(1500), 946684800LL * 1000000000 + 1500);
  EXPECT_EQ(DcToUnixTime(~std::uint64_t{0}), INT64_MAX);
}

TEST(DcTime, UnwrapsToTheNearestTime) {
  const std::uint64_t near = 0x0000000500000010;
  EXPECT_EQ(UnwrapDcTime(0x00000010, near), 0x0000000500000010U);
  EXPECT_EQ(UnwrapDcTime(0x00000FFF, near), 0x0000000500000FFFU);
  EXPECT_EQ(UnwrapDcTime(0xFFFFFFF0, near), 0x00000004FFFFFFF0U);
  EXPECT_EQ(UnwrapDcTime(0x00000010, 0x00000004FFFFFFF0), 0x0000000500000010U);
}

TEST(TimeDifference, MagnitudeAndSignBit) {
  EXPECT_EQ(TimeDifference{0x00000012}.magnitude_ns(), 18U);
  EXPECT_FALSE(TimeDifference{0x00000012}.bit31());
  EXPECT_EQ(TimeDifference{0x80000012}.magnitude_ns(), 18U);
  EXPECT_TRUE(TimeDifference{0x80000012}.bit31());
}

TEST(SpeedCounter, StartHas15BitsAndTheDifferenceASign) {
  EXPECT_EQ(SpeedCounterStart(0x9000), 0x1000);
  EXPECT_EQ(SpeedCounterDifference(0xFFFE), -2);
}

// Typical words of esc-reference 10.1.
TEST(AssignActivate, Words) {
  const AssignActivate sync0{0x0300};
  EXPECT_TRUE(sync0.activation().active());
  EXPECT_TRUE(sync0.activation().sync0());
  EXPECT_FALSE(sync0.activation().sync1());
  EXPECT_FALSE(sync0.control().sync_by_pdi());
  const AssignActivate both{0x0730};
  EXPECT_TRUE(both.activation().sync1());
  EXPECT_TRUE(both.control().latch0_by_pdi());
  EXPECT_TRUE(both.control().latch1_by_pdi());
  EXPECT_FALSE(AssignActivate{0x0000}.activation().active());
}

TEST(SyncActivation, UpperBits) {
  EXPECT_TRUE(SyncActivation{0x08}.auto_activation());
  EXPECT_TRUE(SyncActivation{0x10}.extends_start_time());
  EXPECT_TRUE(SyncActivation{0x20}.checks_start_time());
  EXPECT_TRUE(SyncActivation{0x40}.near_future());
  EXPECT_TRUE(SyncActivation{0x80}.debug_pulse());
}

TEST(SyncUnit, StatusPulseAndLatches) {
  EXPECT_TRUE(ActivationStatus{0x04}.start_time_implausible());
  EXPECT_TRUE(ActivationStatus{0x03}.sync0_pending());
  EXPECT_TRUE(ActivationStatus{0x02}.sync1_pending());
  EXPECT_EQ(PulseLengthNs(0x9C40), 400000U);
  EXPECT_TRUE(LatchControl{0x01}.positive_single());
  EXPECT_TRUE(LatchControl{0x02}.negative_single());
  EXPECT_TRUE(LatchStatus{0x01}.positive_event());
  EXPECT_TRUE(LatchStatus{0x02}.negative_event());
  EXPECT_TRUE(LatchStatus{0x04}.pin());
}

// esc-reference 4.5: 2498 + 2 periods are 100 us, times 1000 are 100 ms.
TEST(Watchdog, DefaultIs100ms) {
  EXPECT_EQ(WatchdogTickNs(kDefaultWatchdogDivider), 100'000);
  EXPECT_EQ(WatchdogNs(0x09C2, 0x03E8), 100'000'000);
  EXPECT_EQ(WatchdogNs(0x09C2, 0), 0);
  EXPECT_EQ(WatchdogNs(0xFFFF, 0xFFFF), 65537LL * 40 * 65535);
}

}  // namespace
}  // namespace ecaudit::esc
