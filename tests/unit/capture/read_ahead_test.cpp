#include "decoder/capture/read_ahead.h"

#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::capture {
namespace {

/// `count` packets, the n-th with n % 1500 bytes of value n, then `end`.
class Counting final : public FrameSource {
 public:
  Counting(std::uint64_t count, ReadStatus end) : count_(count), end_(end) {}
  ReadStatus Next(CapturedFrame& frame) noexcept override {
    if (info_.packets == count_) return end_;
    const std::uint64_t n = ++info_.packets;
    bytes_.assign(n % 1500, static_cast<std::uint8_t>(n));
    frame = {};
    frame.number = n;
    frame.time = static_cast<TimeNs>(n * 10);
    frame.has_time = true;
    frame.bytes = bytes_;
    return ReadStatus::kFrame;
  }
  const CaptureInfo& info() const noexcept override { return info_; }
  std::uint64_t bytes_read() const noexcept override { return info_.packets * 100; }
  std::uint64_t bytes_total() const noexcept override { return count_ * 100; }

 private:
  std::uint64_t count_;
  ReadStatus end_;
  CaptureInfo info_;
  std::vector<std::uint8_t> bytes_;
};

TEST(ReadAhead, HandsOutEveryPacketOnceAndInOrder) {
  Counting source(20'000, ReadStatus::kEnd);
  ReadAhead ahead(source);
  CapturedFrame frame;
  std::uint64_t expected = 0;
  std::uint64_t read = 0;
  while (ahead.Next(frame) == ReadStatus::kFrame) {
    ++expected;
    ASSERT_EQ(frame.number, expected);
    ASSERT_EQ(frame.time, static_cast<TimeNs>(expected * 10));
    ASSERT_EQ(frame.bytes.size(), expected % 1500);
    if (!frame.bytes.empty()) {
      ASSERT_EQ(frame.bytes.front(), static_cast<std::uint8_t>(expected));
      ASSERT_EQ(frame.bytes.back(), static_cast<std::uint8_t>(expected));
    }
    ASSERT_GE(ahead.bytes_read(), read);
    read = ahead.bytes_read();
  }
  EXPECT_EQ(expected, 20'000U);
  EXPECT_EQ(ahead.info().packets, 20'000U);
  EXPECT_EQ(ahead.bytes_read(), ahead.bytes_total());
}

TEST(ReadAhead, TellsTheEndAgainAndAgain) {
  for (const ReadStatus end : {ReadStatus::kEnd, ReadStatus::kDamaged}) {
    for (const std::uint64_t count : {0U, 1U, 3'000U}) {
      Counting source(count, end);
      ReadAhead ahead(source);
      CapturedFrame frame;
      std::uint64_t packets = 0;
      ReadStatus status = ReadStatus::kFrame;
      while ((status = ahead.Next(frame)) == ReadStatus::kFrame) ++packets;
      EXPECT_EQ(packets, count);
      EXPECT_EQ(status, end);
      EXPECT_EQ(ahead.Next(frame), end);
    }
  }
}

TEST(ReadAhead, EndsWhenTheCallerStopsEarly) {
  Counting source(~std::uint64_t{0}, ReadStatus::kEnd);
  for (const int packets : {0, 1, 5'000}) {
    ReadAhead ahead(source);
    CapturedFrame frame;
    for (int i = 0; i < packets; ++i) ASSERT_EQ(ahead.Next(frame), ReadStatus::kFrame);
  }
}

TEST(ReadAhead, ReadsNotFartherAheadThanItsBatches) {
  Counting source(~std::uint64_t{0}, ReadStatus::kEnd);
  {
    ReadAhead ahead(source);
    CapturedFrame frame;
    ASSERT_EQ(ahead.Next(frame), ReadStatus::kFrame);
  }
  // Packets have 749 bytes in the mean.
  EXPECT_LT(source.info().packets, ReadAhead::kBatches * (ReadAhead::kBatchBytes / 700 + 1500));
}

}  // namespace
}  // namespace ecaudit::capture
