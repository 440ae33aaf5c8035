#include "analyzers/signals/signal_value.h"

#include <gtest/gtest.h>

namespace ecaudit::signals {
namespace {

using mailbox::DataType;

TEST(SignalValueTest, IntegersBySign) {
  EXPECT_EQ(ReadSignal(DataType::kInteger16, 16, 0xFFFE), SignalValue(std::int64_t{-2}));
  EXPECT_EQ(ReadSignal(DataType::kUnsigned16, 16, 0xFFFE), SignalValue(std::uint64_t{0xFFFE}));
  EXPECT_EQ(ReadSignal(DataType::kInteger64, 64, ~std::uint64_t{0}), SignalValue(std::int64_t{-1}));
  EXPECT_EQ(ReadSignal(DataType::kInteger32, 32, 0x7FFFFFFF), SignalValue(std::int64_t{0x7FFFFFFF}));
}

TEST(SignalValueTest, LowHalfOfAnObjectKeepsItsSign) {
  EXPECT_EQ(ReadSignal(DataType::kInteger32, 16, 0x8000), SignalValue(std::int64_t{-32768}));
}

TEST(SignalValueTest, BitsBooleansAndUnknownTypesAreUnsigned) {
  EXPECT_EQ(ReadSignal(DataType::kBoolean, 1, 1), SignalValue(std::uint64_t{1}));
  EXPECT_EQ(ReadSignal(DataType::kUnknown, 8, 0xFF), SignalValue(std::uint64_t{0xFF}));
  EXPECT_EQ(ReadSignal(DataType::kWord, 16, 0x8000), SignalValue(std::uint64_t{0x8000}));
}

TEST(SignalValueTest, Reals) {
  EXPECT_EQ(ReadSignal(DataType::kReal32, 32, 0x3FC00000), SignalValue(1.5));
  EXPECT_EQ(ReadSignal(DataType::kReal64, 64, 0xC004000000000000), SignalValue(-2.5));
  EXPECT_EQ(ReadSignal(DataType::kReal32, 16, 0x3FC0), SignalValue(std::uint64_t{0x3FC0}));  // no whole one
}

TEST(SignalValueTest, ScalesAreRatios) {
  EXPECT_EQ(DivisorOf("1000:1"), 1000.0);
  EXPECT_EQ(DivisorOf("1:1"), 1.0);
  EXPECT_EQ(DivisorOf("1:10"), 0.1);
  for (const char* none : {"", "var", ":", "1000", "1000:", "0:1", "1:0", "-1:1", "1e999:1", "1000:1x"}) {
    EXPECT_EQ(DivisorOf(none), std::nullopt) << none;
  }
}

TEST(SignalValueTest, Scaling) {
  EXPECT_EQ(Scaled(std::int64_t{-1500}, 1000.0), SignalValue(-1.5));
  EXPECT_EQ(Scaled(std::uint64_t{7}, 1.0), SignalValue(std::uint64_t{7}));
}

}  // namespace
}  // namespace ecaudit::signals
