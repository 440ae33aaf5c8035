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
