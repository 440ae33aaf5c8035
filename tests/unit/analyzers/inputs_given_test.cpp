#include "analyzers/model/inputs_given.h"

#include <gtest/gtest.h>

namespace ecaudit::model {
namespace {

/// Slaves that may be in any state, each with inputs (1) and outputs (2).
Counting Free(unsigned slaves) {
  return {.inputs = slaves, .take = slaves, .miss = slaves};
}

/// Every way in which slaves that give nothing, their inputs, or all make up the counter, one after the other.
bool ByTrying(unsigned slaves, unsigned wkc) {
  bool with_all = false;
  for (unsigned whole = 0; whole <= slaves; ++whole) {
    for (unsigned inputs = 0; whole + inputs <= slaves; ++inputs) {
      if (3 * whole + inputs != wkc) continue;
      if (whole + inputs < slaves) return false;
      with_all = true;
    }
  }
  return with_all;
}

TEST(InputsGiven, ThreeOfNineIsOneWholeSlaveAsWellAsTheInputsOfThree) {
  EXPECT_FALSE(OnlyWithAllInputs(Free(3), 3));
  EXPECT_TRUE(OnlyWithAllInputs(Free(3), 5));
  EXPECT_TRUE(OnlyWithAllInputs(Free(3), 7));
  EXPECT_FALSE(OnlyWithAllInputs(Free(3), 6));
  EXPECT_TRUE(OnlyWithAllInputs(Free(3), 9));
}

TEST(InputsGiven, IsWhatTryingAllWaysTells) {
  for (unsigned slaves = 1; slaves <= 12; ++slaves) {
    for (unsigned wkc = 0; wkc <= 3 * slaves; ++wkc) {
      EXPECT_EQ(OnlyWithAllInputs(Free(slaves), wkc), ByTrying(slaves, wkc)) << slaves << " slaves, " << wkc;
    }
  }
}

TEST(InputsGiven, StatesLeaveOneWay) {
  // All in SAFEOP: nobody takes outputs, and nobody has left.
  EXPECT_TRUE(OnlyWithAllInputs({.inputs = 3}, 3));
  // On the way to OP, from SAFEOP: nobody is below.
  EXPECT_TRUE(OnlyWithAllInputs({.inputs = 3, .take = 3}, 3));
  // One in OP for certain takes its outputs.
  EXPECT_FALSE(OnlyWithAllInputs({.inputs = 3, .take = 3, .surely_take = 1}, 3));
  EXPECT_TRUE(OnlyWithAllInputs({.inputs = 3, .take = 3, .surely_take = 1}, 5));
}

TEST(InputsGiven, TerminalsThatWouldNotTakeOutputsCostNoneWhenTheyAreMissing) {
  // Two terminals with inputs only beside a drive: 3 is all three, or the drive alone.
  EXPECT_FALSE(OnlyWithAllInputs({.inputs = 3, .take = 1, .miss = 3, .miss_nothing = 2}, 3));
  // With one terminal two would have to be missing, and one of them is the drive.
  EXPECT_TRUE(OnlyWithAllInputs({.inputs = 2, .take = 1, .miss = 2, .miss_nothing = 1}, 2));
}

}  // namespace
}  // namespace ecaudit::model
