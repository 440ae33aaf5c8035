#include "cli/stream/frame_range.h"

#include <gtest/gtest.h>

namespace ecaudit::cli {
namespace {

FrameRange Read(const std::string& frames, const AnalysisOptions& analysis = {}) {
  const Result<FrameRange> range = ReadFrameRange(analysis, frames);
  EXPECT_TRUE(range.has_value()) << frames;
  return range.has_value() ? *range : FrameRange{};
}

TEST(FrameRange, Forms) {
  EXPECT_EQ(Read("743-800").from_frame, 743U);
  EXPECT_EQ(Read("743-800").to_frame, 800U);
  EXPECT_EQ(Read("760").from_frame, 760U);
  EXPECT_EQ(Read("760").to_frame, 760U);
  EXPECT_FALSE(Read("743-").to_frame.has_value());
  EXPECT_FALSE(Read("-800").from_frame.has_value());
}

TEST(FrameRange, NarrowsFromAndTo) {
  AnalysisOptions analysis;
  analysis.from_frame = 5;
  analysis.to_frame = 9;
  EXPECT_EQ(Read("1-7", analysis).from_frame, 5U);
  EXPECT_EQ(Read("1-7", analysis).to_frame, 7U);
  EXPECT_FALSE(ReadFrameRange(analysis, "10-12").has_value());
}

TEST(FrameRange, Mistakes) {
  for (const char* text : {"", "-", "0", "0-5", "a", "1-b", "1-2-3", " 1", "-0", "99999999999999999999999"}) {
    EXPECT_FALSE(ReadFrameRange({}, std::string(text)).has_value()) << text;
  }
}

TEST(FrameRange, LimitsAreInclusive) {
  FrameRange range;
  range.from_frame = 3;
  range.to_frame = 4;
  EXPECT_FALSE(range.Contains(2, 0.0));
  EXPECT_TRUE(range.Contains(3, 0.0));
  EXPECT_TRUE(range.Contains(4, std::nullopt));
  EXPECT_FALSE(range.Contains(5, 0.0));
  range = {};
  range.from_s = 1.0;
  range.to_s = 2.0;
  EXPECT_TRUE(range.Contains(1, 1.0));
  EXPECT_TRUE(range.Contains(1, 2.0));
  EXPECT_FALSE(range.Contains(1, 0.999));
  EXPECT_FALSE(range.Contains(1, 2.001));
  EXPECT_TRUE(range.Contains(1, std::nullopt)) << "a packet without a time stamp is not left out";
}

}  // namespace
}  // namespace ecaudit::cli
