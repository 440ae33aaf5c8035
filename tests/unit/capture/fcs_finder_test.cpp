#include "decoder/capture/fcs_finder.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include "decoder/capture/capture_stream.h"
#include "tests/unit/capture/pcapng_bytes.h"

namespace ecaudit::capture {
namespace {

constexpr std::uint32_t kPcapNanoseconds = 0xA1B23C4D;

/// BRD of AL Status in a frame of the least length.
Bytes ShortFrame(std::uint8_t index = 1, std::size_t size = 60) {
  Bytes frame(size, 0);
  const Bytes head{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1, 1, 1, 1, 1, 1, 0x88, 0xA4, 0x0E, 0x10, 7, index};
  std::copy(head.begin(), head.end(), frame.begin());
  return frame;
}

Bytes WithFcs(Bytes frame) {
  const auto sum = static_cast<std::uint32_t>(crc32(0, frame.data(), static_cast<unsigned>(frame.size())));
  for (unsigned shift = 0; shift < 32; shift += 8) frame.push_back(static_cast<std::uint8_t>(sum >> shift));
  return frame;
}

CapturedFrame Packet(const Bytes& bytes, std::uint32_t original = 0) {
  CapturedFrame frame;
  frame.bytes = bytes;
  frame.original_length = original == 0 ? static_cast<std::uint32_t>(bytes.size()) : original;
  return frame;
}

Bytes PcapFile(std::uint32_t link_field, const std::vector<Bytes>& packets) {
  const PcapngBytes order;
  Bytes file = PcapngBytes::Join({order.U32(kPcapNanoseconds), order.U16(2), order.U16(4), order.U32(0), order.U32(0),
                                  order.U32(65535), order.U32(link_field)});
  for (const Bytes& packet : packets) {
    const auto size = static_cast<std::uint32_t>(packet.size());
    const Bytes record = PcapngBytes::Join({order.U32(1), order.U32(0), order.U32(size), order.U32(size), packet});
    file.insert(file.end(), record.begin(), record.end());
  }
  return file;
}

/// FCS bytes of each packet, as the reader of the file finds them.
std::vector<unsigned> FcsOf(const Bytes& file) {
  auto source = OpenCaptureFromMemory(file, "x");
  EXPECT_TRUE(source);
  std::vector<unsigned> found;
  CapturedFrame frame;
  while (source && (*source)->Next(frame) == ReadStatus::kFrame) found.push_back(frame.fcs_bytes);
  return found;
}

TEST(FcsFinder, FindsWhatNoFileDeclares) {
  FcsFinder finder;
  const Bytes sent = ShortFrame();
  const Bytes returned = WithFcs(ShortFrame());
  // The recording machine sends without FCS and receives with it.
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(finder.In(Packet(sent)), 0U);
    EXPECT_EQ(finder.In(Packet(returned)), 4U);
  }
}

TEST(FcsFinder, StopsLookingWhereTheFirstFramesHaveNone) {
  FcsFinder finder;
  const Bytes plain = ShortFrame();
  const Bytes with = WithFcs(ShortFrame());
  for (int i = 0; i < 32; ++i) EXPECT_EQ(finder.In(Packet(plain)), 0U);
  EXPECT_EQ(finder.In(Packet(with)), 0U);
}

TEST(FcsFinder, FourOtherBytesAreNoFcs) {
  FcsFinder finder;
  Bytes wrong = WithFcs(ShortFrame());
  wrong.back() ^= 1U;
  EXPECT_EQ(finder.In(Packet(wrong)), 0U);
  const Bytes with = WithFcs(ShortFrame());
  EXPECT_EQ(finder.In(Packet(with, 200)), 0U) << "cut: its end is not in the capture";
}

TEST(FcsFinder, WhatTheFileDeclaresIsTakenOffOnceAndNotFromDatagrams) {
  FcsFinder finder;
  finder.Declare(4);
  Bytes wrong = WithFcs(ShortFrame());
  wrong.back() ^= 1U;
  EXPECT_EQ(finder.In(Packet(wrong)), 4U);
  const CapturedFrame once = [&] {
    CapturedFrame frame = Packet(wrong);
    frame.fcs_bytes = finder.In(frame);
    return frame.WithoutFcs();
  }();
  EXPECT_EQ(once.bytes.size(), 60U);
  EXPECT_EQ(once.original_length, 60U);
  EXPECT_EQ(finder.In(once), 0U) << "60 bytes are the least without FCS";
  // A sent frame of 80 bytes whose datagrams reach to its end.
  Bytes full = ShortFrame(1, 80);
  full[14] = 64;
  EXPECT_EQ(finder.In(Packet(full)), 0U);
  EXPECT_EQ(finder.In(Packet(WithFcs(full))), 4U);
}

TEST(FcsFinder, OnlyWhatWasCapturedOfItIsTakenOff) {
  const Bytes frame = ShortFrame(1, 62);
  CapturedFrame packet = Packet(frame, 64);
  packet.fcs_bytes = 4;
  EXPECT_EQ(packet.WithoutFcs().bytes.size(), 60U);
  EXPECT_EQ(packet.WithoutFcs().original_length, 60U);
}

TEST(FcsFinder, PcapDeclaresItAboveTheLinkType) {
  Bytes wrong = WithFcs(ShortFrame());
  wrong.back() ^= 1U;
  EXPECT_EQ(FcsOf(PcapFile(0x2400'0001, {wrong})), std::vector<unsigned>{4}) << "two words";
  EXPECT_EQ(FcsOf(PcapFile(0x4400'0001, {wrong})), std::vector<unsigned>{4}) << "four bytes";
  EXPECT_EQ(FcsOf(PcapFile(0x4000'0001, {wrong})), std::vector<unsigned>{0}) << "the bit that it is there is not set";
  EXPECT_EQ(FcsOf(PcapFile(1, {wrong, WithFcs(ShortFrame()), wrong})), (std::vector<unsigned>{0, 4, 0}));
}

TEST(FcsFinder, PcapngDeclaresItForInterfacesAndPackets) {
  const PcapngBytes order;
  Bytes wrong = WithFcs(ShortFrame());
  wrong.back() ^= 1U;
  PcapngBytes file;
  file.Section().Interface(order.Option(13, Bytes{4})).Interface(order.Option(13, Bytes{32})).Interface();
  file.Enhanced(0, 1, wrong).Enhanced(1, 2, wrong).Enhanced(2, 3, wrong);
  file.Enhanced(2, 4, wrong, order.Option(2, order.U32(0x80)));  // epb_flags: four bytes
  EXPECT_EQ(FcsOf(file.bytes()), (std::vector<unsigned>{4, 4, 0, 4}));
}

}  // namespace
}  // namespace ecaudit::capture
