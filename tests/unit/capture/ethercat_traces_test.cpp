#include "decoder/capture/ethercat_traces.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::capture {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes FrameBehind(std::size_t other) {
  Bytes bytes(other + 12, 0x11);
  for (const int byte : {0x88, 0xA4, 0x0E, 0x10, 7, 0, 0, 0, 0x30, 0x01, 2, 0, 0, 0, 0, 0, 0, 0}) {
    bytes.push_back(static_cast<std::uint8_t>(byte));
  }
  return bytes;
}

TEST(EtherCatTraces, AFrameAfterWhateverAnUnknownLinkTypePutsInFront) {
  for (const std::size_t other : {std::size_t{0}, std::size_t{4}, std::size_t{23}, std::size_t{64}}) {
    EXPECT_TRUE(HoldsEtherCat(FrameBehind(other))) << other;
  }
  EXPECT_FALSE(HoldsEtherCat(FrameBehind(200)));
}

TEST(EtherCatTraces, TheTypeAloneIsNone) {
  Bytes bytes = FrameBehind(4);
  bytes[19] = 0x40;  // EtherCAT type 4: no commands
  EXPECT_FALSE(HoldsEtherCat(bytes));
  bytes = FrameBehind(4);
  bytes[20] = 15;  // no command
  EXPECT_FALSE(HoldsEtherCat(bytes));
  bytes = FrameBehind(4);
  bytes[18] = 4;  // shorter than its datagram
  EXPECT_FALSE(HoldsEtherCat(bytes));
  EXPECT_FALSE(HoldsEtherCat(Bytes{0x88, 0xA4}));
  EXPECT_FALSE(HoldsEtherCat({}));
}

TEST(EtherCatTraces, LinkTypesHaveNames) {
  EXPECT_EQ(LinkTypeText(240), "link type 240 (netANALYZER)");
  EXPECT_EQ(LinkTypeText(999), "link type 999");
}

}  // namespace
}  // namespace ecaudit::capture
