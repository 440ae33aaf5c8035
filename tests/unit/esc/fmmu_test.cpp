#include "decoder/esc/fmmu.h"

#include <array>

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

using FmmuBytes = std::array<std::uint8_t, kFmmuBytes>;

// esc-reference 7: TwinCAT maps one bit of the status of sync manager 1.
constexpr FmmuBytes kTwinCatStatus = {0, 0, 0, 9, 1, 0, 0, 0, 0x0D, 0x08, 0, 1, 1, 0, 0, 0};
// soem-sdinfo-akd, frames 739 and 741.
constexpr FmmuBytes kAkdOutputs = {0, 0, 0, 0, 0x11, 0, 0, 7, 0x00, 0x11, 0, 2, 1, 0, 0, 0};
constexpr FmmuBytes kAkdInputs = {0x11, 0, 0, 0, 0x11, 0, 0, 7, 0x40, 0x11, 0, 1, 1, 0, 0, 0};

TEST(Fmmu, MailboxStateOfTwinCat) {
  const auto fmmu = Fmmu::Decode(kTwinCatStatus);
  ASSERT_TRUE(fmmu);
  EXPECT_EQ(fmmu->logical_start, 0x09000000U);
  EXPECT_EQ(fmmu->length, 1);
  EXPECT_EQ(fmmu->bit_count(), 1U);
  EXPECT_EQ(fmmu->physical_start, 0x080D);
  EXPECT_TRUE(fmmu->reads());
  EXPECT_FALSE(fmmu->writes());
  EXPECT_TRUE(fmmu->active());
  EXPECT_FALSE(fmmu->byte_aligned());
  EXPECT_EQ(fmmu->physical_end(), 0x080EU);
  EXPECT_EQ(fmmu->ToPhysicalBit(std::uint64_t{0x09000000} * 8), std::uint64_t{0x080D} * 8);
  EXPECT_FALSE(fmmu->ToPhysicalBit(std::uint64_t{0x09000000} * 8 + 1));
}

TEST(Fmmu, ProcessDataOfARealAkd) {
  const Fmmu outputs = *Fmmu::Decode(kAkdOutputs);
  EXPECT_TRUE(outputs.writes());
  EXPECT_FALSE(outputs.reads());
  EXPECT_TRUE(outputs.byte_aligned());
  EXPECT_EQ(outputs.bit_count(), 17U * 8);
  EXPECT_EQ(outputs.physical_end(), 0x1111U);
  const Fmmu inputs = *Fmmu::Decode(kAkdInputs);
  EXPECT_EQ(inputs.logical_start, 17U);
  EXPECT_TRUE(Intersect(inputs.logical_bits(), outputs.logical_bits()).empty());
  // The cyclic LRW covers [0, 34): each FMMU shares all of its bits.
  EXPECT_EQ(outputs.Overlap(0, 34), (BitRange{0, 136}));
  EXPECT_EQ(inputs.Overlap(0, 34), (BitRange{136, 136}));
  EXPECT_TRUE(inputs.Overlap(0, 17).empty());
  EXPECT_EQ(inputs.Overlap(16, 2), (BitRange{136, 8}));
}

// Bits 6 to 1 of the next byte, onto ESC bits 3 to 6 of 0x0F00: (2 - 1) * 8 + 1 - 6 + 1 = 4 bits.
TEST(Fmmu, BitsAcrossAByte) {
  const Fmmu fmmu = *Fmmu::Decode(FmmuBytes{0x10, 0, 0, 0, 2, 0, 6, 1, 0x00, 0x0F, 3, 2, 1, 0, 0, 0});
  EXPECT_EQ(fmmu.bit_count(), 4U);
  EXPECT_EQ(fmmu.logical_bits(), (BitRange{0x10 * 8 + 6, 4}));
  EXPECT_EQ(fmmu.physical_bits(), (BitRange{0x0F00 * 8 + 3, 4}));
  EXPECT_EQ(fmmu.ToPhysicalBit(0x11 * 8 + 1), 0x0F00U * 8 + 6);
  EXPECT_FALSE(fmmu.ToPhysicalBit(0x11 * 8 + 2));
  EXPECT_FALSE(fmmu.ToPhysicalBit(0x10 * 8 + 5));
  EXPECT_EQ(fmmu.ToLogicalBit(0x0F00 * 8 + 3), 0x10U * 8 + 6);
  EXPECT_FALSE(fmmu.ToLogicalBit(0x0F00 * 8 + 2));
  EXPECT_FALSE(fmmu.ToLogicalBit(0x0F00 * 8 + 7));
  EXPECT_EQ(fmmu.Overlap(0x11, 1), (BitRange{0x11 * 8, 2}));
  EXPECT_EQ(fmmu.physical_end(), 0x0F01U);
}

TEST(Fmmu, EveryBitMapsBothWays) {
  const Fmmu fmmu{0x00010000, 5, 3, 2, 0x1234, 5, 3, 1};
  ASSERT_EQ(fmmu.bit_count(), 4U * 8 + 2 - 3 + 1);
  for (std::uint64_t i = 0; i < fmmu.bit_count(); ++i) {
    const auto physical = fmmu.ToPhysicalBit(fmmu.logical_bits().first + i);
    ASSERT_TRUE(physical);
    EXPECT_EQ(*physical, 0x1234U * 8 + 5 + i);
    EXPECT_EQ(fmmu.ToLogicalBit(*physical), fmmu.logical_bits().first + i);
  }
}

TEST(Fmmu, SenselessSettingsMapNothing) {
  EXPECT_EQ((Fmmu{0, 0, 0, 7, 0x1000, 0, 1, 1}).bit_count(), 0U);
  EXPECT_EQ((Fmmu{0, 1, 5, 4, 0x1000, 0, 1, 1}).bit_count(), 0U);
  EXPECT_EQ((Fmmu{0, 1, 5, 3, 0x1000, 0, 1, 1}).bit_count(), 0U);
  EXPECT_EQ((Fmmu{0, 1, 5, 3, 0x1000, 0, 1, 1}).physical_end(), 0x1000U);
  EXPECT_TRUE((Fmmu{0, 0, 0, 7, 0x1000, 0, 1, 1}).Overlap(0, 1486).empty());
}

TEST(Fmmu, EndsOfTheAddressSpaces) {
  const Fmmu fmmu{0xFFFFFFFF, 0xFFFF, 0, 7, 0xFFFF, 7, 1, 1};
  EXPECT_EQ(fmmu.bit_count(), 0xFFFFU * 8);
  EXPECT_EQ(fmmu.physical_end(), 0x1FFFFU);
  EXPECT_EQ(fmmu.Overlap(0xFFFFFFFF, 1).count, 8U);
  EXPECT_TRUE(fmmu.Overlap(0, 1486).empty());
}

TEST(Fmmu, BitNumbersKeepThreeBitsAndShortInputIsRefused) {
  const auto fmmu = Fmmu::Decode(FmmuBytes{0, 0, 0, 0, 1, 0, 0xF8, 0xFF, 0, 0x10, 0x09, 3, 0xFF, 0, 0, 0});
  EXPECT_EQ(fmmu->logical_start_bit, 0);
  EXPECT_EQ(fmmu->logical_stop_bit, 7);
  EXPECT_EQ(fmmu->physical_start_bit, 1);
  EXPECT_TRUE(fmmu->active());
  EXPECT_TRUE(Fmmu::Decode(ByteSpan(kAkdInputs).first(13)));
  EXPECT_FALSE(Fmmu::Decode(ByteSpan(kAkdInputs).first(12)));
}

TEST(Fmmu, Addresses) {
  EXPECT_EQ(FmmuAddress(0), 0x0600);
  EXPECT_EQ(FmmuAddress(2), 0x0620);
  EXPECT_EQ(FmmuAddress(15), 0x06F0);
}

}  // namespace
}  // namespace ecaudit::esc
