#include "decoder/esc/bit_copy.h"

#include <array>

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

TEST(CopyBits, WholeBytesAndARest) {
  const std::array<std::uint8_t, 3> from = {0x11, 0x22, 0xFF};
  std::array<std::uint8_t, 4> to{};
  EXPECT_TRUE(CopyBits(from, 0, to, 8, 19));
  EXPECT_EQ(to, (std::array<std::uint8_t, 4>{0x00, 0x11, 0x22, 0x07}));
}

TEST(CopyBits, ShiftedBitsLeaveTheirNeighboursAlone) {
  const std::array<std::uint8_t, 2> from = {0x80, 0x02};  // bits 7 to 9 are 1, 0, 1
  std::array<std::uint8_t, 1> to = {0xC2};
  EXPECT_TRUE(CopyBits(from, 7, to, 1, 3));
  EXPECT_EQ(to[0], 0xCA);
  EXPECT_TRUE(CopyBits(from, 0, to, 6, 2));
  EXPECT_EQ(to[0], 0x0A);
}

TEST(CopyBits, SameResultAsBitByBit) {
  const std::array<std::uint8_t, 4> from = {0x5A, 0xC3, 0x0F, 0x96};
  for (unsigned from_bit = 0; from_bit < 12; ++from_bit) {
    for (unsigned to_bit = 0; to_bit < 12; ++to_bit) {
      std::array<std::uint8_t, 4> to = {0xFF, 0x00, 0xFF, 0x00};
      const auto before = to;
      ASSERT_TRUE(CopyBits(from, from_bit, to, to_bit, 17));
      for (unsigned i = 0; i < 32; ++i) {
        const unsigned got = to[i / 8] >> (i % 8) & 1U;
        const bool copied = i >= to_bit && i < to_bit + 17;
        const unsigned source = i - to_bit + from_bit;
        EXPECT_EQ(got, copied ? from[source / 8] >> (source % 8) & 1U : before[i / 8] >> (i % 8) & 1U);
      }
    }
  }
}

TEST(CopyBits, OutsideABufferNothingIsCopied) {
  const std::array<std::uint8_t, 2> from = {0xFF, 0xFF};
  std::array<std::uint8_t, 2> to{};
  EXPECT_FALSE(CopyBits(from, 9, to, 0, 8));
  EXPECT_FALSE(CopyBits(from, 0, to, 9, 8));
  EXPECT_FALSE(CopyBits(from, 17, to, 0, 0));
  EXPECT_FALSE(CopyBits(from, 0, to, 0, ~std::uint64_t{0}));
  EXPECT_TRUE(CopyBits(from, 16, to, 16, 0));
  EXPECT_EQ(to, (std::array<std::uint8_t, 2>{}));
}

}  // namespace
}  // namespace ecaudit::esc
