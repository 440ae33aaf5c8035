#include "decoder/capture/pcapng_writer.h"

#include <array>

#include <gtest/gtest.h>

#include "decoder/capture/capture_stream.h"
#include "tests/unit/capture/pcapng_bytes.h"

namespace ecaudit::capture {
namespace {

const Bytes kPcapngWriterData{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13};

CapturedFrame Packet(TimeNs time, std::uint16_t interface = 0, ByteSpan bytes = kPcapngWriterData) {
  CapturedFrame frame;
  frame.time = time;
  frame.has_time = true;
  frame.interface_index = interface;
  frame.original_length = 60;
  frame.bytes = bytes;
  return frame;
}

Interface Named(std::string name, std::int64_t resolution_ns, std::uint16_t link_type = 1) {
  Interface interface;
  interface.name = std::move(name);
  interface.resolution_ns = resolution_ns;
  interface.link_type = link_type;
  interface.snap_length = 128;
  return interface;
}

WholeCapture Read(const std::string& file) {
  return ReadAll(OpenCaptureFromMemory(Bytes(file.begin(), file.end()), "x"));
}

TEST(PcapngWriter, IsReadAsItWasWritten) {
  std::string file;
  PcapngWriter writer(file);
  writer.BeginSection("ecaudit 1.0", "of the file");
  writer.AddInterface(Named("eth0", 1));
  writer.AddInterface(Named("", 1000, 113));
  CapturedFrame second = Packet(1'556'712'000'123'456'000, 1);
  second.flag = PacketFlag::kOutbound;
  writer.AddPacket(Packet(1'556'712'000'000'000'007), std::array<std::string, 2>{"one", "two, longer"});
  writer.AddPacket(second, {});
  const WholeCapture read = Read(file);
  EXPECT_EQ(read.end, ReadStatus::kEnd) << read.damage();
  ASSERT_EQ(read.frames.size(), 2U);
  EXPECT_EQ(read.frames[0].time, 1'556'712'000'000'000'007);
  EXPECT_EQ(read.frames[0].bytes, kPcapngWriterData);
  EXPECT_EQ(read.frames[0].original_length, 60U);
  EXPECT_EQ(read.frames[0].flag, PacketFlag::kNone);
  EXPECT_EQ(read.frames[1].time, 1'556'712'000'123'456'000);
  EXPECT_EQ(read.frames[1].interface_index, 1);
  EXPECT_EQ(read.frames[1].link_type, 113);
  EXPECT_EQ(read.frames[1].flag, PacketFlag::kOutbound);
  ASSERT_EQ(read.info.interfaces.size(), 2U);
  EXPECT_EQ(read.info.interfaces[0].name, "eth0");
  EXPECT_EQ(read.info.interfaces[0].resolution_ns, 1);
  EXPECT_EQ(read.info.interfaces[0].snap_length, 128U);
  EXPECT_EQ(read.info.interfaces[1].resolution_ns, 1000);
  ASSERT_EQ(read.info.comments.size(), 3U);
  EXPECT_EQ(read.info.comments[0].frame, 0U);
  EXPECT_EQ(read.info.comments[0].text, "of the file");
  EXPECT_EQ(read.info.comments[1].text, "one");
  EXPECT_EQ(read.info.comments[2].text, "two, longer");
  EXPECT_EQ(read.info.comments[2].frame, 1U);
}

// Every resolution that a file can have: what the reader makes of its ticks comes out of the copy the same.
TEST(PcapngWriter, KeepsTheResolutionAndTheStamps) {
  for (const int tsresol : {0, 1, 3, 6, 7, 8, 9, 0x80 | 1, 0x80 | 10, 0x80 | 20, 0x80 | 29}) {
    PcapngBytes original;
    original.Section();
    original.Interface(
        PcapngBytes::Join({original.Option(9, Bytes{static_cast<std::uint8_t>(tsresol)}), original.EndOfOptions()}));
    for (const std::uint64_t ticks : {0ULL, 1ULL, 3ULL, 999'999'937ULL, 1'500'000'001ULL}) {
      original.Enhanced(0, ticks, kPcapngWriterData);
    }
    const WholeCapture before = ReadAll(OpenCaptureFromMemory(original.bytes(), "x"));
    std::string file;
    PcapngWriter writer(file);
    writer.BeginSection("t", "");
    writer.AddInterface(before.info.interfaces.at(0));
    for (const OwnedFrame& frame : before.frames) writer.AddPacket(Packet(frame.time), {});
    const WholeCapture after = Read(file);
    ASSERT_EQ(after.frames.size(), before.frames.size());
    EXPECT_EQ(after.info.interfaces[0].resolution_ns, before.info.interfaces[0].resolution_ns) << tsresol;
    for (std::size_t i = 0; i < before.frames.size(); ++i) {
      EXPECT_EQ(after.frames[i].time, before.frames[i].time) << tsresol << " " << i;
    }
  }
}

TEST(PcapngWriter, CutsLongCommentsBetweenCharacters) {
  std::string file;
  PcapngWriter writer(file);
  writer.BeginSection("t", "");
  writer.AddInterface(Named("eth0", 1));
  std::string text = "a";
  while (text.size() < 2 * PcapngWriter::kMaxCommentBytes) text += "\xC3\xA4";
  writer.AddPacket(Packet(1), std::array{text});
  EXPECT_LT(file.size(), PcapngWriter::kMaxCommentBytes + 300);
  EXPECT_EQ(Read(file).frames.size(), 1U);
  EXPECT_EQ(Read(file).end, ReadStatus::kEnd);
}

TEST(PcapngWriter, PacketWithoutStampAndOfAnUnknownInterface) {
  std::string file;
  PcapngWriter writer(file);
  writer.BeginSection("t", "");
  writer.AddInterface(Named("eth0", 1));
  CapturedFrame frame = Packet(0);
  frame.has_time = false;
  writer.AddPacket(frame, {});
  writer.AddPacket(Packet(5, 1), {});
  const WholeCapture read = Read(file);
  EXPECT_EQ(read.end, ReadStatus::kEnd);
  ASSERT_EQ(read.frames.size(), 1U);
  EXPECT_EQ(read.frames[0].time, 0);
}

TEST(PcapngWriter, DropsOfTheCapturingMachine) {
  std::string file;
  PcapngWriter writer(file);
  Interface interface = Named("eth0", 1);
  interface.dropped = 7;
  writer.BeginSection("t", "");
  writer.AddInterface(interface);
  writer.AddPacket(Packet(1), {});
  writer.AddStatistics({interface});
  const WholeCapture read = Read(file);
  EXPECT_EQ(read.end, ReadStatus::kEnd) << read.damage();
  EXPECT_EQ(read.info.interfaces.at(0).dropped, 7U);
}

}  // namespace
}  // namespace ecaudit::capture
