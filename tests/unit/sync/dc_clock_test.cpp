#include "analyzers/sync/dc_clock.h"

#include <array>

#include <gtest/gtest.h>

namespace ecaudit::sync {
namespace {

/// One answer to a read of 0x0910.
struct Reading {
  wire::Command command = wire::Command::FRMW;
  SlaveId slave = 0;
  std::uint64_t time = 0;
  std::size_t bytes = 8;
  TimeNs at = 0;
  std::uint16_t wkc = 1;
  EscAddress address = 0x0910;
};

class Clock {
 public:
  std::optional<DcTime> Read(const Reading& reading) {
    std::array<std::uint8_t, 16> returned{};
    const std::size_t at = static_cast<std::size_t>(0x0910 - reading.address);
    for (std::size_t i = 0; i < 8; ++i) returned[at + i] = static_cast<std::uint8_t>(reading.time >> (8 * i));
    track::Answered answer;
    answer.command = reading.command;
    answer.slave = reading.slave;
    answer.address = reading.address;
    answer.wkc = reading.wkc;
    answer.sent = {++frame_, reading.at, true};
    answer.returned = {++frame_, reading.at + 30'000, true};
    answer.sent_data = ByteSpan(kZeros).first(at + reading.bytes);
    answer.returned_data = ByteSpan(returned).first(at + reading.bytes);
    return clock.On(answer);
  }

  DcClock clock;

 private:
  static constexpr std::array<std::uint8_t, 16> kZeros{};
  FrameNo frame_ = 0;
};

TEST(DcClock, SixtyFourBitTimesPassAsTheyAre) {
  Clock c;
  EXPECT_EQ(c.Read({.time = 848546483402428137})->ns, 848546483402428137U);
  EXPECT_EQ(c.Read({.time = 848546483402539062, .at = 110'925})->ns, 848546483402539062U);
  EXPECT_EQ(c.clock.samples(), 2U);
  EXPECT_EQ(c.clock.distributions(), 2U);
  EXPECT_EQ(c.clock.longest_gap(), 110'925);
}

TEST(DcClock, BroadcastTimeThatGoesOnIsDistributed) {
  Clock c;
  const auto write = [&](std::uint64_t time, TimeNs at, std::uint16_t wkc = 3) {
    EXPECT_FALSE(c.Read({.command = wire::Command::BWR, .slave = kNoSlave, .time = time, .at = at, .wkc = wkc}));
  };
  write(0, 0);  // a scan
  EXPECT_EQ(c.clock.distributions(), 0U);
  write(848546483402428137, 1'000'000);
  write(848546483403428137, 2'000'000);
  EXPECT_EQ(c.clock.distributions(), 1U);
  write(848546483403428137, 3'000'000);     // the same again
  write(848546483402428137, 4'000'000);     // back
  write(848546483409428137, 5'000'000, 0);  // nobody took it
  EXPECT_EQ(c.clock.distributions(), 1U);
  EXPECT_EQ(c.clock.last_distribution().time, 2'030'000);
  EXPECT_EQ(c.clock.reference(), kNoSlave);
  EXPECT_EQ(c.clock.samples(), 0U);
}

TEST(DcClock, LowHalvesAreNoWholeTimesAlthoughTheClockHasThem) {
  Clock c;
  c.Read({.command = wire::Command::FPRD, .time = 848546483402428137});
  EXPECT_TRUE(c.clock.is_64_bit());
  c.clock.WasSet(0);
  const auto low = c.Read({.time = 0x12345678, .bytes = 4, .at = 1000});
  EXPECT_FALSE(c.clock.is_64_bit());
  EXPECT_EQ(c.Read({.time = 0x12345A78, .bytes = 4, .at = 2000})->epoch, low->epoch);
  const auto full = c.Read({.command = wire::Command::FPRD, .time = 848546483402430137, .at = 3000});
  EXPECT_TRUE(c.clock.is_64_bit());
  EXPECT_NE(full->epoch, low->epoch);
  EXPECT_EQ(c.Read({.time = 848546483402431137 & 0xFFFFFFFF, .bytes = 4, .at = 4000})->ns, 848546483402431137U);
}

TEST(DcClock, ThirtyTwoBitTimesAreExtendedOverTheirWrap) {
  Clock c;
  EXPECT_EQ(c.Read({.time = 0xFFFFFF00, .bytes = 4})->ns, 0xFFFFFF00U);
  EXPECT_EQ(c.Read({.time = 0x00000100, .bytes = 4, .at = 512})->ns, 0x1'0000'0100U);
  EXPECT_EQ(c.Read({.time = 0xFFFFFFFF, .bytes = 4, .at = 3'900'000'000})->ns, 0x1'FFFF'FFFFU);
  EXPECT_EQ(c.Read({.time = 0x00000002, .bytes = 4, .at = 3'900'000'003})->ns, 0x2'0000'0002U);
  EXPECT_EQ(c.clock.epoch(), 0U);
}

TEST(DcClock, ThirtyTwoBitTimesReadWithEightBytesWrapAsWell) {
  Clock c;
  EXPECT_EQ(c.Read({.time = 0xFFFFFF00})->ns, 0xFFFFFF00U);
  EXPECT_EQ(c.Read({.time = 0x00000100, .at = 512})->ns, 0x1'0000'0100U);
}

TEST(DcClock, APauseLongerThanAWrapBeginsANewEpoch) {
  Clock c;
  const auto before = c.Read({.time = 1000, .bytes = 4});
  const auto after = c.Read({.time = 2000, .bytes = 4, .at = 4'300'000'000});
  EXPECT_NE(before->epoch, after->epoch);
}

TEST(DcClock, ALeapThatTheStampsDoNotShowBeginsANewEpoch) {
  Clock c;
  c.Read({.time = 5'000'000'000});
  EXPECT_EQ(c.Read({.time = 5'001'000'000, .at = 1'000'000})->epoch, 0U);
  EXPECT_EQ(c.Read({.time = 6'002'000'000, .at = 2'000'000})->epoch, 1U);  // set a second ahead
  EXPECT_EQ(c.Read({.time = 6'003'000'000, .at = 3'000'000})->epoch, 1U);
  EXPECT_EQ(c.Read({.time = 7'503'000'000, .at = 1'103'000'000})->epoch, 1U);  // stamped late by 0.4 s
  EXPECT_EQ(c.Read({.time = 7'504'000'000U | std::uint64_t{1} << 63U, .at = 1'104'000'000})->epoch, 2U);
  EXPECT_EQ(c.Read({.time = 7'505'000'000, .at = 1'105'000'000})->epoch, 3U);
}

TEST(DcClock, AStepBackOf32BitIsNoWrapThatTheStampsDoNotShow) {
  Clock c;
  c.Read({.time = 2'000'000'000, .bytes = 4});
  const auto back = c.Read({.time = 1'984'000'000, .bytes = 4, .at = 1'000'000});
  EXPECT_EQ(back->epoch, 1U);
  EXPECT_EQ(back->ns, 1'984'000'000U);
}

TEST(DcClock, TimesACenturyApartAreNoInterval) {
  constexpr std::uint64_t kFar = std::uint64_t{1} << 63U;
  EXPECT_EQ(Forward({1000, 0}, {3000, 0}), 2000);
  EXPECT_FALSE(Forward({3000, 0}, {3000, 0}));
  EXPECT_FALSE(Forward({3000, 0}, {1000, 0}));
  EXPECT_FALSE(Forward({1000, 0}, {3000, 1}));
  EXPECT_FALSE(Forward({1000, 0}, {kFar + 500, 0}));
  FrameTime a, b;
  a.dc = DcTime{1000, 0};
  b.dc = DcTime{kFar + 1500, 0};
  a.stamp = 0;
  b.stamp = 1'000'000;
  EXPECT_EQ(Between(a, b).base, TimeBase::kNone);
}

TEST(DcClock, SettingTheReferenceBeginsANewEpoch) {
  Clock c;
  const auto before = c.Read({.time = 1'000'000'000'000});
  c.clock.WasSet(1);
  EXPECT_EQ(c.Read({.time = 1'000'000'001'000})->epoch, before->epoch);
  c.clock.WasSet(0);
  EXPECT_NE(c.Read({.time = 5'000'000'000'000})->epoch, before->epoch);
  // Set back unseen.
  const auto last = c.clock.last();
  EXPECT_NE(c.Read({.time = 4'000'000'000'000})->epoch, last->epoch);
}

TEST(DcClock, OnlyTheReferenceCounts) {
  Clock c;
  ASSERT_TRUE(c.Read({.command = wire::Command::FPRD, .slave = 2, .time = 7'000'000'000'000}));
  // The slave that is distributed takes over from one that was merely read.
  ASSERT_TRUE(c.Read({.slave = 0, .time = 7'000'000'001'000}));
  EXPECT_EQ(c.clock.reference(), 0U);
  EXPECT_FALSE(c.Read({.command = wire::Command::FPRD, .slave = 2, .time = 7'000'000'002'000}));
  EXPECT_TRUE(c.Read({.command = wire::Command::FPRD, .slave = 0, .time = 7'000'000'003'000}));
  EXPECT_EQ(c.clock.distributions(), 1U);
}

TEST(DcClock, WhatNoSlaveGaveIsNoTime) {
  Clock c;
  EXPECT_FALSE(c.Read({.time = 5, .wkc = 0}));
  EXPECT_FALSE(c.Read({.time = 0, .wkc = 2}));  // the others wrote, the reference did not read
  EXPECT_FALSE(c.Read({.time = 5, .bytes = 2}));
  EXPECT_FALSE(c.Read({.command = wire::Command::BRD, .time = 5, .wkc = 2}));  // OR of two clocks
  EXPECT_FALSE(c.Read({.command = wire::Command::FPWR, .time = 5}));
  EXPECT_EQ(c.clock.samples(), 0U);
  EXPECT_TRUE(c.Read({.command = wire::Command::BRD, .slave = kNoSlave, .time = 5, .wkc = 1}));
}

TEST(DcClock, BehindTheReferenceWhatWasSentHoldsItsTimeAlready) {
  DcClock clock;
  FrameNo number = 0;
  const auto frame = [&](std::uint8_t time, std::uint16_t sent_wkc) {
    const std::array<std::uint8_t, 8> data{time, 1, 0, 0, 0, 0, 0, 0};
    track::Answered answer;
    answer.command = wire::Command::FRMW;
    answer.slave = 0;
    answer.address = 0x0910;
    answer.wkc = 2;
    answer.sent_wkc = sent_wkc;
    answer.sent = {++number, 0, false};
    answer.returned = {++number, 0, false};
    answer.sent_data = answer.returned_data = data;
    return clock.On(answer).has_value();
  };
  EXPECT_TRUE(frame(10, 1));
  EXPECT_TRUE(frame(20, 1));
  EXPECT_FALSE(frame(20, 1)) << "a master that sends on what it got last, and another slave counted";
  EXPECT_FALSE(frame(30, 0)) << "nobody had counted";
}

TEST(DcClock, AReadThatBeginsEarlierHoldsTheTimeAsWell) {
  Clock c;
  EXPECT_EQ(c.Read({.command = wire::Command::FPRD, .time = 0x1234567890, .address = 0x0908})->ns, 0x1234567890U);
}

}  // namespace
}  // namespace ecaudit::sync
