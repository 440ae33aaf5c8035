#include "analyzers/model/still_cycle.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::model {
namespace {

const std::vector<std::uint8_t> kData = {0x37, 0x12, 0x0F, 0x00, 0x08, 0x55};

TEST(StillCycle, NothingRepeatsBeforeTheUnitsAreStill) {
  StillCycle still;
  EXPECT_FALSE(still.Repeats(1, Exchange::kUnknown, kData));
  ASSERT_TRUE(still.Watch(kData, 0, 16));
  EXPECT_FALSE(still.Repeats(1, Exchange::kUnknown, kData));
}

TEST(StillCycle, RepeatsWhileTheWatchedWordsStayTheSame) {
  StillCycle still;
  ASSERT_TRUE(still.Watch(kData, 0, 16));
  ASSERT_TRUE(still.Watch(kData, 32, 8));
  still.Settle(5, Exchange::kYes);
  EXPECT_TRUE(still.Repeats(5, Exchange::kYes, kData));

  std::vector<std::uint8_t> data = kData;
  data[2] = 0xEE;  // nobody looks at it
  data[5] = 0xEE;
  EXPECT_TRUE(still.Repeats(5, Exchange::kYes, data));
  for (const std::size_t watched : {0U, 1U, 4U}) {
    data = kData;
    data[watched] ^= 0x80;
    EXPECT_FALSE(still.Repeats(5, Exchange::kYes, data)) << watched;
  }
}

TEST(StillCycle, AnotherExchangeOrAStirredModelIsNoRepetition) {
  StillCycle still;
  still.Settle(5, Exchange::kYes);
  EXPECT_TRUE(still.Repeats(5, Exchange::kYes, kData));
  EXPECT_FALSE(still.Repeats(6, Exchange::kYes, kData));
  for (const Exchange other : {Exchange::kInferred, Exchange::kNo, Exchange::kUnknown}) {
    EXPECT_FALSE(still.Repeats(5, other, kData));
  }
  still.Clear();
  EXPECT_FALSE(still.Repeats(5, Exchange::kYes, kData));
}

TEST(StillCycle, ShorterDataHoldNoWatchedWord) {
  StillCycle still;
  ASSERT_TRUE(still.Watch(kData, 32, 16));
  still.Settle(1, Exchange::kYes);
  EXPECT_FALSE(still.Repeats(1, Exchange::kYes, ByteSpan(kData).first(5)));
  EXPECT_FALSE(still.Repeats(1, Exchange::kYes, {}));
}

TEST(StillCycle, WatchesWholeBytesInsideTheDataOnly) {
  StillCycle still;
  EXPECT_FALSE(still.Watch(kData, 1, 16));
  EXPECT_FALSE(still.Watch(kData, 0, 4));
  EXPECT_FALSE(still.Watch(kData, 0, 32));
  EXPECT_FALSE(still.Watch(kData, 40, 16));
  EXPECT_TRUE(still.Watch(kData, 40, 8));
  for (std::size_t i = 1; i < StillCycle::kMaxWords; ++i) EXPECT_TRUE(still.Watch(kData, 0, 16));
  EXPECT_FALSE(still.Watch(kData, 0, 16));
}

}  // namespace
}  // namespace ecaudit::model
