#include "decoder/base/bytes.h"

#include <array>
#include <limits>

#include <gtest/gtest.h>

namespace ecaudit {
namespace {

constexpr std::array<std::uint8_t, 4> kBytes{0x01, 0x02, 0x03, 0x04};

TEST(Bytes, IntegersInBothByteOrders) {
  EXPECT_EQ(LittleEndian<std::uint32_t>(kBytes, 0), 0x04030201U);
  EXPECT_EQ(BigEndian<std::uint16_t>(kBytes, 1), 0x0203U);
}

TEST(Bytes, WhatDoesNotFitReadsAsZero) {
  EXPECT_EQ(LittleEndian<std::uint32_t>(kBytes, 1), 0U);
  EXPECT_EQ(LittleEndian<std::uint8_t>(kBytes, 4), 0U);
  EXPECT_EQ(BigEndian<std::uint32_t>(kBytes, 1), 0U);
}

TEST(Bytes, AllBytesAsOneInteger) {
  EXPECT_EQ(UnsignedOf(kBytes), 0x04030201U);
  EXPECT_EQ(UnsignedOf({}), 0U);
  constexpr std::array<std::uint8_t, 9> nine{0, 0, 0, 0, 0, 0, 0, 0x80, 0xFF};
  EXPECT_EQ(UnsignedOf(nine), 0x8000'0000'0000'0000U);
}

TEST(Bytes, SignOfAnyWidth) {
  EXPECT_EQ(SignExtend(0x7F, 8), 127);
  EXPECT_EQ(SignExtend(0x80, 8), -128);
  EXPECT_EQ(SignExtend(0x1, 1), -1);
  EXPECT_EQ(SignExtend(0xFF'FFFF, 24), -1);
  EXPECT_EQ(SignExtend(0xABCD'0003, 3), 3);
  EXPECT_EQ(SignExtend(0xFFFF'FFFF'FFFF'FFFE, 64), -2);
  EXPECT_EQ(SignExtend(5, 0), 5);
}

TEST(Bytes, FitsIsSafeAgainstOverflow) {
  EXPECT_TRUE(Fits(kBytes, 0, 4));
  EXPECT_TRUE(Fits(kBytes, 4, 0));
  EXPECT_FALSE(Fits(kBytes, 1, 4));
  EXPECT_FALSE(Fits(kBytes, 2, std::numeric_limits<std::size_t>::max()));
}

TEST(Bytes, SliceStaysInside) {
  EXPECT_EQ(Slice(kBytes, 2).size(), 2U);
  EXPECT_EQ(Slice(kBytes, 2, 1).size(), 1U);
  EXPECT_TRUE(Slice(kBytes, 9).empty());
}

}  // namespace
}  // namespace ecaudit
