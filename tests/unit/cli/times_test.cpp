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

constexpr TimeNs kNoon = 1'556'712'000'000'000'000;  // 2019-05-01 12:00:00 UTC

TEST(Times, ReadsWhatItWrites) {
  for (const TimeNs time : {TimeNs{0}, TimeNs{-1}, kNoon + 123'456'789, TimeNs{951'782'400'000'000'001}}) {
    EXPECT_EQ(ParseIsoTime(IsoTime(time), false), time) << IsoTime(time);
    EXPECT_EQ(ParseIsoTime(IsoLocalTime(time), false), time) << IsoLocalTime(time);
  }
}

TEST(Times, ReadsWhatPeopleWrite) {
  EXPECT_EQ(ParseIsoTime("2019-05-01T12:00:00Z", false), kNoon);
  EXPECT_EQ(ParseIsoTime("2019-05-01 12:00", false), kNoon);
  EXPECT_EQ(ParseIsoTime("2019-05-01T14:00:00.5+02:00", false), kNoon + 500'000'000);
  EXPECT_EQ(ParseIsoTime("2019-05-01T09:30:00-0230", false), kNoon);
  EXPECT_EQ(ParseIsoTime("2019-05-01", false), kNoon - TimeNs{43'200} * 1'000'000'000);
  for (const char* text :
       {"", "2019", "2019-13-01", "2019-02-29", "2019-05-01T", "2019-05-01T25:00", "2019-05-01T12:00x",
        "2019-05-01T12:00:00.", "2019-05-01T12:00:00+2", "19-05-01", "2019-05-01T12:00:00ZZ"}) {
    EXPECT_FALSE(ParseIsoTime(text, false)) << text;
  }
}

TEST(Times, Moments) {
  const FrameRef first{1, kNoon, true};
  const FrameRef later{9, kNoon + 759'123'456, true};
  EXPECT_EQ(MomentText(TimeMode::kRelative, first, later, 6), "0.759123 s");
  EXPECT_EQ(MomentText(TimeMode::kUtc, first, later, 3), "12:00:00.759");
  EXPECT_EQ(MomentText(TimeMode::kUtc, first, {9, kNoon + TimeNs{86'400} * 1'000'000'000, true}, 0),
            "2019-05-02 12:00:00");
  EXPECT_EQ(MomentText(TimeMode::kUtc, first, {9, 0, false}, 3), "");
  EXPECT_EQ(MomentText(TimeMode::kRelative, {}, later, 3), "");
  EXPECT_EQ(ZoneText(kNoon, false), "UTC");
  EXPECT_EQ(ParseTimeMode("utc"), TimeMode::kUtc);
  EXPECT_FALSE(ParseTimeMode("UTC"));
}

}  // namespace
}  // namespace ecaudit::report
