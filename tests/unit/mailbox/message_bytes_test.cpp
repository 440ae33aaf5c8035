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

}  // namespace
}  // namespace ecaudit::mailbox
