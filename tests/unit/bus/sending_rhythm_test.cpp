#include "decoder/bus/sending_rhythm.h"

#include <gtest/gtest.h>

#include "decoder/bus/early_returns.h"

namespace ecaudit::bus::test {
namespace {

constexpr std::int64_t kCycleNs = 1'000'000;

SendingRhythm Steady(std::uint32_t frames) {
  SendingRhythm rhythm;
  for (std::uint32_t i = 0; i < frames; ++i) EXPECT_FALSE(rhythm.TakeDistance(kCycleNs));
  return rhythm;
}

TEST(SendingRhythm, SilenceIsAMultipleOfTheLongestDistance) {
  EXPECT_FALSE(Steady(threshold::kRhythmKnownFrames).TakeDistance(kCycleNs * threshold::kSilenceTimes));
  EXPECT_TRUE(Steady(threshold::kRhythmKnownFrames).TakeDistance(kCycleNs * (threshold::kSilenceTimes + 1)));
  EXPECT_FALSE(Steady(threshold::kRhythmKnownFrames - 1).TakeDistance(kCycleNs * (threshold::kSilenceTimes + 1)));
}

TEST(SendingRhythm, ASilenceDoesNotCountAsDistance) {
  SendingRhythm rhythm = Steady(threshold::kRhythmFrames);
  EXPECT_TRUE(rhythm.TakeDistance(100 * kCycleNs));
  EXPECT_EQ(rhythm.mean_ns(), kCycleNs);
  EXPECT_EQ(rhythm.shortest_ns(), kCycleNs);
}

TEST(SendingRhythm, StampsThatFramesShareShowNoDistance) {
  SendingRhythm rhythm = Steady(threshold::kRhythmFrames);
  const FrameRef sent{1, 0, true};
  const FrameRef returned{2, kCycleNs, true};
  EXPECT_TRUE(rhythm.OnlyOneFits(sent, returned));
  for (int i = 0; i <= threshold::kSharedScore / threshold::kSharedOneIn; ++i) rhythm.CompareStamps(0);
  EXPECT_FALSE(rhythm.OnlyOneFits(sent, returned));
}

TEST(RoundTrip, SaysWhatIsLateAndWhatIsSoon) {
  RoundTrip trip;
  EXPECT_FALSE(trip.known());
  trip.Add(10'000);
  EXPECT_TRUE(trip.IsFine());
  EXPECT_FALSE(trip.IsLate(threshold::kLateTimes * 10'000));
  EXPECT_TRUE(trip.IsLate((threshold::kLateTimes + 1) * 10'000));
  EXPECT_TRUE(trip.IsSoon({1, 0, true}, {2, threshold::kLateTimes * 10'000, true}));
  EXPECT_FALSE(trip.IsSoon({1, 0, true}, {2, threshold::kLateTimes * 10'000 + 1, true}));
  EXPECT_TRUE(trip.IsSoon({1, 0, true}, {2, 0, false})) << "frames without stamps go by alone";
}

TEST(RoundTrip, CoarseStampsAreNotFine) {
  RoundTrip trip;
  trip.Add(threshold::kFineRoundTripNs + 1);
  EXPECT_FALSE(trip.IsFine());
}

TEST(EarlyReturns, StampsHaveToShowIt) {
  capture::CapturedFrame packet;
  packet.number = 2;
  packet.time = kCycleNs;
  packet.has_time = true;
  const wire::FrameView sent = wire::FrameView::Parse(packet);
  const auto is_of = [&](std::int64_t apart, std::uint16_t interface_index, bool clocks_differ) {
    const EarlyReturns::Return early{sent.key(), {1, packet.time + apart, true}, interface_index};
    return early.IsOf(sent, clocks_differ);
  };
  EXPECT_FALSE(is_of(0, 0, false)) << "on one interface equal stamps show nothing";
  EXPECT_TRUE(is_of(1, 0, false));
  EXPECT_TRUE(is_of(0, 1, false));
  EXPECT_FALSE(is_of(-1, 1, false));
  EXPECT_TRUE(is_of(-threshold::kSkewNs, 1, true)) << "the clocks of the interfaces differ";
  EXPECT_FALSE(is_of(-1, 0, true)) << "one interface has one clock";
  EXPECT_FALSE(is_of(threshold::kRecentNs + 1, 1, true));
}

}  // namespace
}  // namespace ecaudit::bus::test
