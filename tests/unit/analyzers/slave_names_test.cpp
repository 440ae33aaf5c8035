#include "analyzers/options/slave_names.h"

#include <gtest/gtest.h>

namespace ecaudit {
namespace {

constexpr SlaveNames kFromZero{};
constexpr SlaveNames kFromOne{.from_one = true};

TEST(SlaveNames, CountsFromZeroAsEtherCatDoes) {
  EXPECT_EQ(kFromZero.Number(0), "0");
  EXPECT_EQ(kFromZero.Short(3), "S3");
  EXPECT_EQ(kFromZero.Of(0), "slave 0");
  EXPECT_EQ(kFromZero.Of(0, "AKD, 0x1001"), "slave 0 (AKD, 0x1001)");
  EXPECT_EQ(kFromZero.Of(std::set<unsigned>{2}), "slave 2");
  EXPECT_EQ(kFromZero.Of({0, 1, 2, 3, 7}), "slaves 0-3, 7");
  EXPECT_EQ(kFromZero.Span(0, 39), "slaves 0-39");
  EXPECT_EQ(kFromZero.List({0, 2, 5, 6}, 2), "slaves 0, 2 and 2 more");
  EXPECT_EQ(kFromZero.Position(0), SlavePos{0});
}

TEST(SlaveNames, CountsFromOneWithThePositionBesideTheNumber) {
  EXPECT_EQ(kFromOne.Number(0), "1");
  EXPECT_EQ(kFromOne.Short(3), "S4");
  EXPECT_EQ(kFromOne.Of(0), "slave 1 (position 0)");
  EXPECT_EQ(kFromOne.Of(0, "AKD, 0x1001"), "slave 1 (position 0, AKD, 0x1001)");
  EXPECT_EQ(kFromOne.Of(std::set<unsigned>{2}), "slave 3 (position 2)");
  EXPECT_EQ(kFromOne.Of({0, 1, 2, 3, 7}), "slaves 1-4, 8 (positions 0-3, 7)");
  EXPECT_EQ(kFromOne.Span(0, 39), "slaves 1-40 (positions 0-39)");
  EXPECT_EQ(kFromOne.List({0, 2, 5, 6}, 2), "slaves 1, 3 (positions 0, 2) and 2 more");
  EXPECT_EQ(kFromOne.List({0, 2}, 4), "slaves 1, 3 (positions 0, 2)");
  EXPECT_EQ(kFromOne.Position(1), SlavePos{0});
  EXPECT_EQ(kFromOne.Position(0), std::nullopt);
  EXPECT_EQ(kFromOne.Of(65535), "slave 65536 (position 65535)");
}

}  // namespace
}  // namespace ecaudit
