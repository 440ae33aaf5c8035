#include "decoder/bus/traffic_reader.h"

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus {
namespace {

using capture::CapturedFrame;
using capture::ReadStatus;
using ecaudit::test::MemorySource;
using ecaudit::test::Packet;
using ecaudit::test::Trace;
using test::PairingLog;
using test::PairUp;

constexpr PacketRange kAll;
using Got = TrafficReader::Got;

/// What came out of a reader, and the counters of Pairing at its end.
struct Received {
  PairingLog log;
  PairingStatistics statistics;
  std::vector<FrameNo> packets;
};

Received Listen(capture::FrameSource& source, const PacketRange& range = kAll) {
  Received received;
  TrafficReader reader(source, range, nullptr, received.log);
  for (Got got = reader.Next(); got != Got::kEnd; got = reader.Next()) {
    if (got != Got::kPacket) continue;
    received.packets.push_back(reader.packet().ref().number);
    reader.Pair();
  }
  EXPECT_EQ(reader.Next(), Got::kEnd) << "again and again";
  reader.Finish();
  received.statistics = reader.statistics();
  return received;
}

/// Polls of three slaves, some lost, some repeated, some damaged, with other packets between.
std::vector<Packet> RoughTraffic(int exchanges) {
  Trace trace;
  trace.Slaves(3);
  for (int n = 0; n < exchanges; ++n) {
    trace.At(n * 1000).Brd(0x0130, {8, 0}).Lrw(0x1000, {1, 2, 3, static_cast<std::uint8_t>(n)}, {4, 5, 6, 7});
  }
  std::vector<Packet> packets = trace.Packets();
  std::vector<Packet> rough;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const bool returned = i % 2 == 1;
    if (returned && i % 46 == 1) continue;  // lost
    rough.push_back(packets[i]);
    if (returned && i % 62 == 1) rough.push_back(packets[i]);  // came back twice
    if (returned && i % 94 == 1) rough.back().bytes.resize(20);
    if (i % 70 == 0) {
      rough.push_back(packets[i]);
      rough.back().bytes.assign(60, 0xFF);  // no EtherCAT
    }
  }
  return rough;
}

void ExpectSame(const PairingStatistics& a, const PairingStatistics& b) {
  EXPECT_EQ(a.outbound, b.outbound);
  EXPECT_EQ(a.returned, b.returned);
  EXPECT_EQ(a.paired, b.paired);
  EXPECT_EQ(a.lost, b.lost);
  EXPECT_EQ(a.duplicated, b.duplicated);
  EXPECT_EQ(a.altered, b.altered);
  EXPECT_EQ(a.undecided, b.undecided);
  EXPECT_EQ(a.in_flight, b.in_flight);
}

TEST(TrafficReader, TellsWhatPairingTellsInTheSameOrder) {
  const std::vector<Packet> packets = RoughTraffic(4'000);
  const test::Paired expected = PairUp(packets, 257);
  ASSERT_FALSE(expected.log.Only("lost").empty());
  ASSERT_FALSE(expected.log.Only("dup").empty());
  ASSERT_FALSE(expected.log.Only("malformed").empty());
  MemorySource source(packets);
  const Received received = Listen(source);
  EXPECT_EQ(received.packets.size(), packets.size());
  EXPECT_EQ(received.log.words, expected.log.words);
  EXPECT_EQ(received.log.sent, expected.log.sent);
  EXPECT_EQ(received.log.doubtful, expected.log.doubtful);
  EXPECT_EQ(received.log.directions, expected.log.directions);
  ExpectSame(received.statistics, expected.statistics);
}

TEST(TrafficReader, ALengthThatIsWrongOnTheWayBackOnlyIsDamage) {
  Trace trace;
  for (int n = 0; n < 200; ++n) trace.At(n * 1000).Fprd(0x1001, 0x0130, {8, 0});
  std::vector<Packet> packets = trace.Packets();
  const auto damage = [&](std::size_t i) { packets.at(i).bytes.at(15) ^= 0x04; };
  damage(121);  // a returned copy
  MemorySource damaged(packets);
  EXPECT_THAT(Listen(damaged).log.Only("malformed"), testing::ElementsAre("malformed 122"));
  for (std::size_t i = 0; i < packets.size(); ++i) {
    if (i != 121) damage(i);
  }
  MemorySource wrong(packets);
  EXPECT_THAT(Listen(wrong).log.Only("malformed"), testing::IsEmpty()) << "slaves answer all of them";
}

/// Compares what is handed over with the bytes of the packets.
class Comparing final : public BusSink {
 public:
  explicit Comparing(const std::vector<Packet>& packets) : packets_(packets) {}
  void OnFrame(const wire::FrameView& frame, Direction) override { Compare(frame); }
  void OnSent(const wire::FrameView& frame) override { Compare(frame); }
  void OnTransaction(const BusTransaction& t) override {
    ASSERT_TRUE(t.sent != nullptr && t.returned != nullptr);
    Compare(*t.sent);
    Compare(*t.returned);
    EXPECT_EQ(t.sent->ref().number + 1, t.returned->ref().number);
    ++transactions;
  }
  void OnDoubtful(const wire::FrameView&) override {}
  void OnLost(const wire::FrameView&, Loss, bool) override {}
  void OnDuplicate(const wire::FrameView&, FrameNo) override {}
  void OnRepeated(const RepeatedFrame&) override {}
  void OnUnusable(const wire::FrameView&, Unusable, bool) override {}

  std::size_t transactions = 0;

 private:
  void Compare(const wire::FrameView& frame) {
    const Packet& packet = packets_.at(static_cast<std::size_t>(frame.ref().number - 1));
    ASSERT_GE(frame.bytes().size(), frame.used_bytes());
    ASSERT_TRUE(std::equal(frame.bytes().begin(), frame.bytes().end(), packet.bytes.begin()));
    ASSERT_EQ(frame.size(), 2U);
    EXPECT_EQ(frame[1].logical_address(), 0x1000U);
  }
  const std::vector<Packet>& packets_;
};

TEST(TrafficReader, HandsOverTheBytesOfBothCopies) {
  Trace trace;
  trace.Slaves(2);
  constexpr std::size_t kExchanges = 2'000;
  for (std::size_t n = 0; n < kExchanges; ++n) {
    trace.At(static_cast<std::int64_t>(n) * 1000)
        .Brd(0x0130, {8, 0})
        .Lrw(0x1000, {1, 2, static_cast<std::uint8_t>(n >> 8U), static_cast<std::uint8_t>(n)}, {4, 5, 6, 7});
  }
  const std::vector<Packet> packets = trace.Packets();
  MemorySource source(packets);
  Comparing sink(packets);
  TrafficReader reader(source, kAll, nullptr, sink);
  for (Got got = reader.Next(); got != Got::kEnd; got = reader.Next()) {
    if (got == Got::kPacket) reader.Pair();
  }
  EXPECT_EQ(sink.transactions, kExchanges);
  EXPECT_EQ(reader.packets_read(), packets.size());
}

TEST(TrafficReader, HandsOverAPacketBeforeItReadsTheNext) {
  const std::vector<Packet> packets = RoughTraffic(400);
  MemorySource source(packets);
  PairingLog log;
  TrafficReader reader(source, kAll, nullptr, log);
  Got got = reader.Next();
  while (got == Got::kNothing) got = reader.Next();
  const std::uint64_t looked_ahead = source.info().packets;
  EXPECT_LT(looked_ahead, packets.size());
  for (FrameNo number = 1; number <= packets.size(); ++number, got = reader.Next()) {
    ASSERT_EQ(got, Got::kPacket);
    ASSERT_EQ(reader.packet().ref().number, number);
    ASSERT_EQ(source.info().packets, std::max<std::uint64_t>(number, looked_ahead));
  }
  EXPECT_EQ(got, Got::kEnd);
}

TEST(TrafficReader, ReadsNoPacketAfterTheRange) {
  const std::vector<Packet> packets = RoughTraffic(3'000);
  MemorySource source(packets);
  PacketRange range;
  range.from_frame = 1'001;
  range.to_frame = 1'500;
  const Received received = Listen(source, range);
  ASSERT_EQ(received.packets.size(), 500U);
  EXPECT_EQ(received.packets.front(), 1'001U);
  EXPECT_EQ(received.packets.back(), 1'500U);
  EXPECT_EQ(source.info().packets, 1'501U) << "one more tells that the range has ended";
}

TEST(TrafficReader, TakesTheRangeInSecondsFromTheFirstPacket) {
  const std::vector<Packet> packets = RoughTraffic(100);  // an exchange a millisecond
  MemorySource source(packets);
  PacketRange range;
  range.from_s = 0.0100;
  range.to_s = 0.0195;
  const Received received = Listen(source, range);
  ASSERT_FALSE(received.packets.empty());
  const TimeNs first = packets.front().time;
  for (const FrameNo number : received.packets) {
    const TimeNs at = packets[static_cast<std::size_t>(number - 1)].time - first;
    EXPECT_GE(at, 10'000'000);
    EXPECT_LE(at, 19'500'000);
  }
  EXPECT_GE(received.packets.size(), 18U);
}

/// `count` packets without EtherCAT, the n-th with n % 1500 bytes.
class Counting final : public capture::FrameSource {
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
    frame.original_length = static_cast<std::uint32_t>(bytes_.size());
    return ReadStatus::kFrame;
  }
  const capture::CaptureInfo& info() const noexcept override { return info_; }
  std::uint64_t bytes_read() const noexcept override { return info_.packets * 100; }
  std::uint64_t bytes_total() const noexcept override { return count_ * 100; }

 private:
  std::uint64_t count_;
  ReadStatus end_;
  capture::CaptureInfo info_;
  std::vector<std::uint8_t> bytes_;
};

TEST(TrafficReader, ReadsOnePacketAtATimeAlsoWhereNoneIsInTheRange) {
  Counting source(9'000, ReadStatus::kEnd);
  PacketRange range;
  range.from_frame = 8'999;
  PairingLog log;
  TrafficReader reader(source, range, nullptr, log);
  std::size_t handed_over = 0;
  for (std::uint64_t n = 1; n <= 9'000; ++n) {
    handed_over += reader.Next() == Got::kPacket ? 1 : 0;
    ASSERT_EQ(reader.packets_read(), n);
  }
  for (Got got = reader.Next(); got != Got::kEnd; got = reader.Next()) ++handed_over;
  EXPECT_EQ(handed_over, 2U);
}

TEST(TrafficReader, EndsAtDamageAndInEmptyCaptures) {
  for (const ReadStatus end : {ReadStatus::kEnd, ReadStatus::kDamaged}) {
    for (const std::uint64_t count : {0U, 1U, 9'000U}) {
      Counting source(count, end);
      EXPECT_EQ(Listen(source).packets.size(), count);
    }
  }
}

TEST(TrafficReader, EndsOnRequestWithWhatWasRead) {
  for (const std::uint64_t until : {100U, 9'000U}) {
    Counting source(~std::uint64_t{0}, ReadStatus::kEnd);
    std::atomic<bool> stop = false;
    PairingLog log;
    TrafficReader reader(source, kAll, &stop, log);
    std::uint64_t packets = 0;
    for (Got got = reader.Next(); got != Got::kEnd; got = reader.Next()) {
      packets += got == Got::kPacket ? 1 : 0;
      if (reader.packets_read() == until) stop = true;
    }
    EXPECT_EQ(packets, until);
    EXPECT_EQ(source.info().packets, until);
  }
}

}  // namespace
}  // namespace ecaudit::bus
