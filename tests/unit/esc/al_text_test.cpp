#include <gtest/gtest.h>

#include "decoder/esc/al.h"

namespace ecaudit::esc {
namespace {

TEST(AlText, StatesOfAllSlavesAreListed) {
  EXPECT_EQ(StatesOfAllText(0x08), "OP");
  EXPECT_EQ(StatesOfAllText(0x18), "OP and the error bit");
  EXPECT_EQ(StatesOfAllText(0x0C), "SAFEOP and OP");
  EXPECT_EQ(StatesOfAllText(0x1C), "SAFEOP and OP, and the error bit");
  EXPECT_EQ(StatesOfAllText(0x0E), "PREOP, SAFEOP and OP");
  EXPECT_EQ(StatesOfAllText(0x03), "BOOT, or INIT and PREOP");
  EXPECT_EQ(StatesOfAllText(0x13), "BOOT, or INIT and PREOP, and the error bit");
  EXPECT_EQ(StatesOfAllText(0x00), "state 0");
}

}  // namespace
}  // namespace ecaudit::esc
