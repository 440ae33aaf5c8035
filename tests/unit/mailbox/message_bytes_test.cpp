#include "decoder/mailbox/message_bytes.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::mailbox {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(MessageBytes, KeepsTheFirstBytesUpToItsLimit) {
  MessageBytes message(10);
  message.Append(Bytes(6, 1));
  message.Append(Bytes(6, 2));
  message.Append(Bytes(1, 3));
  const ByteSpan kept = message;
  EXPECT_EQ(Bytes(kept.begin(), kept.end()), (Bytes{1, 1, 1, 1, 1, 1, 2, 2, 2, 2}));
  message.Clear();
  EXPECT_EQ(message.size(), 0U);
  message.Append(Bytes(3, 4));
  EXPECT_EQ(message.size(), 3U);
}

TEST(MessageBytes, WhatOneHasTheOthersCannotHave) {
  Allowance all(100'000);
  MessageBytes first(80'000, &all);
  MessageBytes second(80'000, &all);
  first.Append(Bytes(60'000, 1));
  second.Append(Bytes(30'000, 2));
  second.Append(Bytes(30'000, 2));
  EXPECT_EQ(second.size(), 30'000U);
  first.Clear();
  second.Append(Bytes(1, 3));
  EXPECT_EQ(second.size(), 30'000U) << "nothing follows behind bytes that were dropped";
  second.Clear();
  second.Append(Bytes(80'000, 4));
  EXPECT_EQ(second.size(), 80'000U) << "what was given back is there again";
}

TEST(MessageBytes, WhatIsOnesOwnTheOthersCannotTake) {
  Allowance all(10'000);
  Allowance own(2'000, &all);
  MessageBytes greedy(80'000, &all);
  greedy.Append(Bytes(10'000, 1));
  MessageBytes message(80'000, &own);
  message.Append(Bytes(1'500, 2));
  EXPECT_EQ(message.size(), 1'500U);
  EXPECT_FALSE(message.full());
  message.Append(Bytes(1'500, 2));
  EXPECT_TRUE(message.full()) << "more than its own, and the others have the rest";
}

TEST(Allowance, GivesBackWhatItBorrowedFirst) {
  Allowance all(100);
  Allowance own(10, &all);
  EXPECT_TRUE(own.Take(60));
  EXPECT_FALSE(all.Take(60));
  own.GiveBack(50);
  EXPECT_TRUE(all.Take(100)) << "all that was borrowed is there again";
  EXPECT_FALSE(own.Take(1));
  own.GiveBack(10);
  EXPECT_TRUE(own.Take(10));
  EXPECT_FALSE(own.Take(1));
}

}  // namespace
}  // namespace ecaudit::mailbox
