#include "decoder/wire/command.h"

#include <gtest/gtest.h>

namespace ecaudit::wire {
namespace {

/// esc-reference 2.1, one row a command.
struct Row {
  std::uint8_t number;
  std::string_view name;
  char address;  // 'p' position, 'n' node, 'b' broadcast, 'l' logical, '-' none
  bool reads;
  bool writes;
  bool counts;  // slaves add one to adp (1.6)
};
constexpr Row kTable[] = {
    {0, "NOP", '-', false, false, false}, {1, "APRD", 'p', true, false, true},  {2, "APWR", 'p', false, true, true},
    {3, "APRW", 'p', true, true, true},   {4, "FPRD", 'n', true, false, false}, {5, "FPWR", 'n', false, true, false},
    {6, "FPRW", 'n', true, true, false},  {7, "BRD", 'b', true, false, true},   {8, "BWR", 'b', false, true, true},
    {9, "BRW", 'b', true, true, true},    {10, "LRD", 'l', true, false, false}, {11, "LWR", 'l', false, true, false},
    {12, "LRW", 'l', true, true, false},  {13, "ARMW", 'p', true, true, true},  {14, "FRMW", 'n', true, true, false},
};

TEST(Command, EveryRowOfTheReference) {
  for (const Row& row : kTable) {
    const auto command = static_cast<Command>(row.number);
    EXPECT_TRUE(IsDefined(row.number));
    EXPECT_EQ(Name(command), row.name);
    EXPECT_EQ(IsPositionAddressed(command), row.address == 'p') << row.name;
    EXPECT_EQ(IsNodeAddressed(command), row.address == 'n') << row.name;
    EXPECT_EQ(IsBroadcast(command), row.address == 'b') << row.name;
    EXPECT_EQ(IsLogical(command), row.address == 'l') << row.name;
    EXPECT_EQ(Reads(command), row.reads) << row.name;
    EXPECT_EQ(Writes(command), row.writes) << row.name;
    EXPECT_EQ(IncrementsAdp(command), row.counts) << row.name;
  }
}

TEST(Command, NumbersAbove14AreNotDefined) {
  for (unsigned number = 15; number < 256; ++number) {
    EXPECT_FALSE(IsDefined(static_cast<std::uint8_t>(number)));
    EXPECT_EQ(Name(static_cast<Command>(number)), "?");
  }
}

}  // namespace
}  // namespace ecaudit::wire
