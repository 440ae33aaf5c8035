#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "cli/wireshark/side_events.h"

namespace ecaudit::cli {
namespace {

struct Written {
  std::vector<std::pair<FrameNo, std::string>> lines;

  SideOrder After(FrameNo wait) {
    return SideOrder(wait, [this](FrameNo frame, std::string_view line) { lines.emplace_back(frame, line); });
  }
};

using Lines = std::vector<std::pair<FrameNo, std::string>>;

TEST(SideOrder, LinesLeaveInTheOrderOfFrames) {
  Written written;
  SideOrder order = written.After(10);
  order.Add(5, "a");
  order.Add(3, "b");
  order.Add(5, "c");
  order.Add(12, "d");
  EXPECT_TRUE(written.lines.empty());
  order.Add(14, "e");  // what belongs to frame 3 can come no more
  EXPECT_EQ(written.lines, (Lines{{3, "b"}}));
  order.End();
  EXPECT_EQ(written.lines, (Lines{{3, "b"}, {5, "a"}, {5, "c"}, {12, "d"}, {14, "e"}}));
  EXPECT_EQ(order.too_late(), 0U);
}

TEST(SideOrder, LateLinesAreCounted) {
  Written written;
  SideOrder order = written.After(0);
  order.Add(4, "a");
  order.Add(4, "b");
  order.Add(3, "c");
  order.Add(0, "not in the capture");
  order.End();
  EXPECT_EQ(written.lines, (Lines{{4, "a"}, {4, "b"}}));
  EXPECT_EQ(order.too_late(), 1U);
}

}  // namespace
}  // namespace ecaudit::cli
