#include "cli/report/times.h"

#include <limits>

#include <gtest/gtest.h>

namespace ecaudit::report {
namespace {

TEST(Times, IsoTime) {
  // Checked with: date -u -d @1556712000, date -u -d @951782400 (29 February 2000)
  EXPECT_EQ(IsoTime(1'556'712'000'123'456'789), "2019-05-01T12:00:00.123456789Z");
  EXPECT_EQ(IsoTime(951'782'400'000'000'001), "2000-02-29T00:00:00.000000001Z");
  EXPECT_EQ(IsoTime(0), "1970-01-01T00:00:00.000000000Z");
}

TEST(Times, BeforeTheEpoch) {
  EXPECT_EQ(IsoTime(-1), "1969-12-31T23:59:59.999999999Z");
}

TEST(Times, TheWholeRangeIsWritten) {
  EXPECT_EQ(IsoTime(std::numeric_limits<TimeNs>::max()), "2262-04-11T23:47:16.854775807Z");
  EXPECT_EQ(IsoTime(std::numeric_limits<TimeNs>::min()), "1677-09-21T00:12:43.145224192Z");
}

TEST(Times, SecondsSince) {
  const FrameRef first{1, 1'000'000'000, true};
  EXPECT_DOUBLE_EQ(*SecondsSince(first, {2, 2'500'000'000, true}), 1.5);
  EXPECT_DOUBLE_EQ(*SecondsSince(first, {2, 0, true}), -1.0);
  EXPECT_FALSE(SecondsSince(first, {2, 0, false}).has_value());
  EXPECT_FALSE(SecondsSince({}, {2, 0, true}).has_value());
  EXPECT_FALSE(SecondsSince({1, std::numeric_limits<TimeNs>::min(), true}, {2, 1, true}).has_value());
}

}  // namespace
}  // namespace ecaudit::report
