#include "decoder/bus/traffic_reader.h"

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

/// What came out of a reader, and the counters of Pairing at its end.
struct Received {
  PairingLog log;
  PairingStatistics statistics;
  std::vector<FrameNo> packets;
  std::size_t ends = 0;  ///< steps without a packet
};

Received Listen(TrafficReader& reader) {
  Received received;
  wire::FrameView packet;
  while (const Traffic* traffic = reader.Next()) {
    for (std::size_t i = 0; i < traffic->size(); ++i) {
      traffic->Restore(i, packet);
      if (packet.ref().seen()) {
        received.packets.push_back(packet.ref().number);
      } else {
        ++received.ends;
      }
      traffic->Replay(i, packet, received.log);
      received.statistics = traffic->StatisticsAfter(i);
    }
  }
  EXPECT_EQ(reader.Next(), nullptr) << "the end is told again and again";
  EXPECT_EQ(received.ends, 1U);
  return received;
}

Received Listen(capture::FrameSource& source, Ahead ahead, const PacketRange& range = kAll) {
  TrafficReader reader(source, range, nullptr, ahead);
  return Listen(reader);
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

TEST(TrafficReader, RepeatsTheCallsOfPairingInTheSameOrder) {
  const std::vector<Packet> packets = RoughTraffic(4'000);
  const test::Paired expected = PairUp(packets, 257);
  ASSERT_FALSE(expected.log.Only("lost").empty());
  ASSERT_FALSE(expected.log.Only("dup").empty());
  ASSERT_FALSE(expected.log.Only("malformed").empty());
  for (const Ahead ahead : {Ahead::kNo, Ahead::kYes}) {
    MemorySource source(packets);
    const Received received = Listen(source, ahead);
    EXPECT_EQ(received.packets.size(), packets.size());
    EXPECT_EQ(received.log.words, expected.log.words);
    EXPECT_EQ(received.log.sent, expected.log.sent);
    EXPECT_EQ(received.log.doubtful, expected.log.doubtful);
    EXPECT_EQ(received.log.directions, expected.log.directions);
    ExpectSame(received.statistics, expected.statistics);
  }
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

TEST(TrafficReader, HandsOverTheBytesOfBothCopiesAcrossBatches) {
  Trace trace;
  trace.Slaves(2);
  constexpr std::size_t kExchanges = 20'000;
  for (std::size_t n = 0; n < kExchanges; ++n) {
    trace.At(static_cast<std::int64_t>(n) * 1000)
        .Brd(0x0130, {8, 0})
        .Lrw(0x1000, {1, 2, static_cast<std::uint8_t>(n >> 8U), static_cast<std::uint8_t>(n)}, {4, 5, 6, 7});
  }
  const std::vector<Packet> packets = trace.Packets();
  for (const Ahead ahead : {Ahead::kNo, Ahead::kYes}) {
    MemorySource source(packets);
    TrafficReader reader(source, kAll, nullptr, ahead);
    Comparing sink(packets);
    wire::FrameView packet;
    std::size_t batches = 0;
    while (const Traffic* traffic = reader.Next()) {
      ++batches;
      for (std::size_t i = 0; i < traffic->size(); ++i) {
        traffic->Restore(i, packet);
        traffic->Replay(i, packet, sink);
      }
    }
    EXPECT_EQ(sink.transactions, kExchanges);
    EXPECT_GT(batches, 5U);
    EXPECT_EQ(reader.packets_read(), packets.size());
  }
}

TEST(TrafficReader, HandsOverAPacketBeforeItReadsTheNext) {
  const std::vector<Packet> packets = RoughTraffic(400);
  MemorySource source(packets);
  TrafficReader reader(source, kAll, nullptr, Ahead::kNo);
  const Traffic* traffic = reader.Next();
  ASSERT_NE(traffic, nullptr);
  FrameNo handed_over = 0;
  wire::FrameView packet;
  for (; traffic != nullptr && handed_over < packets.size(); traffic = reader.Next()) {
    traffic->Restore(traffic->size() - 1, packet);
    if (!packet.ref().seen()) break;
    handed_over = packet.ref().number;
    ASSERT_EQ(source.info().packets, handed_over);
  }
  EXPECT_EQ(handed_over, packets.size());
}

TEST(TrafficReader, ReadsNoPacketAfterTheRange) {
  const std::vector<Packet> packets = RoughTraffic(3'000);
  for (const Ahead ahead : {Ahead::kNo, Ahead::kYes}) {
    MemorySource source(packets);
    PacketRange range;
    range.from_frame = 1'001;
    range.to_frame = 1'500;
    const Received received = Listen(source, ahead, range);
    ASSERT_EQ(received.packets.size(), 500U);
    EXPECT_EQ(received.packets.front(), 1'001U);
    EXPECT_EQ(received.packets.back(), 1'500U);
    EXPECT_EQ(source.info().packets, 1'501U) << "one more tells that the range has ended";
  }
}

TEST(TrafficReader, TakesTheRangeInSecondsFromTheFirstPacket) {
  const std::vector<Packet> packets = RoughTraffic(100);  // an exchange a millisecond
  MemorySource source(packets);
  PacketRange range;
  range.from_s = 0.0100;
  range.to_s = 0.0195;
  const Received received = Listen(source, Ahead::kNo, range);
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

TEST(TrafficReader, ShowsHowFarItIsAlsoWhereNoPacketIsInTheRange) {
  for (const Ahead ahead : {Ahead::kNo, Ahead::kYes}) {
    Counting source(300'000, ReadStatus::kEnd);
    PacketRange range;
    range.from_frame = 299'999;
    TrafficReader reader(source, range, nullptr, ahead);
    std::vector<std::uint64_t> read;
    std::size_t steps = 0;
    while (const Traffic* traffic = reader.Next()) {
      read.push_back(reader.packets_read());
      EXPECT_EQ(reader.bytes_read(), reader.packets_read() * 100);
      steps += traffic->size();
    }
    EXPECT_EQ(steps, 3U) << "two packets and the end";
    EXPECT_GE(read.size(), 300'000 / TrafficReader::kNewsEvery);
    EXPECT_EQ(read.back(), 300'000U);
    EXPECT_EQ(reader.bytes_total(), reader.bytes_read());
  }
}

TEST(TrafficReader, EndsAtDamageAndInEmptyCaptures) {
  for (const ReadStatus end : {ReadStatus::kEnd, ReadStatus::kDamaged}) {
    for (const std::uint64_t count : {0U, 1U, 9'000U}) {
      for (const Ahead ahead : {Ahead::kNo, Ahead::kYes}) {
        Counting source(count, end);
        EXPECT_EQ(Listen(source, ahead).packets.size(), count);
      }
    }
  }
}

TEST(TrafficReader, EndsOnRequestWithWhatWasRead) {
  for (const Ahead ahead : {Ahead::kNo, Ahead::kYes}) {
    Counting source(~std::uint64_t{0}, ReadStatus::kEnd);
    std::atomic<bool> stop = false;
    TrafficReader reader(source, kAll, &stop, ahead);
    std::size_t ends = 0;
    wire::FrameView packet;
    while (const Traffic* traffic = reader.Next()) {
      stop = true;
      if (traffic->size() == 0) continue;
      traffic->Restore(traffic->size() - 1, packet);
      ends += packet.ref().seen() ? 0 : 1;
    }
    EXPECT_EQ(ends, 1U);
  }
}

TEST(TrafficReader, GoesAwayBeforeTheEnd) {
  Counting source(~std::uint64_t{0}, ReadStatus::kEnd);
  for (const int batches : {0, 1, 5}) {
    TrafficReader reader(source, kAll, nullptr, Ahead::kYes);
    for (int i = 0; i < batches; ++i) ASSERT_NE(reader.Next(), nullptr);
  }
}

TEST(TrafficReader, ReadsNotFartherAheadThanItsBatches) {
  Counting source(~std::uint64_t{0}, ReadStatus::kEnd);
  {
    TrafficReader reader(source, kAll, nullptr, Ahead::kYes);
    ASSERT_NE(reader.Next(), nullptr);
  }
  // Of packets without EtherCAT only the fields are kept; the look-ahead comes first.
  EXPECT_LT(source.info().packets,
            2 * TrafficReader::kBatches * TrafficReader::kBatchBytes / sizeof(wire::FrameFields));
}

}  // namespace
}  // namespace ecaudit::bus
