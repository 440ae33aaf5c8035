#include "samples/builder/frame_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::samples {
namespace {

using ::testing::ElementsAreArray;

Datagram ReadAlStatus() {
  Datagram d;
  d.command = Cmd::FPRD;
  d.index = 0x0E;
  d.adp = 0x1001;
  d.ado = 0x0130;
  d.data = {0x00, 0x00};
  return d;
}

// Written by hand from esc-reference 1.3: command, index, address, length, event field, data, working counter.
TEST(FrameBuilder, OneDatagramByteForByte) {
  EtherCatFrame frame;
  frame.datagrams = {ReadAlStatus()};
  const Bytes expected{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x88, 0xA4,  // Ethernet
                       0x0E, 0x10,                                                                          // EtherCAT
                       0x04, 0x0E, 0x01, 0x10, 0x30, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  EXPECT_THAT(EncodePacket(frame), ElementsAreArray(expected));
}

TEST(FrameBuilder, MoreFlagOnAllButTheLastAndCirculatingBit) {
  Datagram first = ReadAlStatus();
  Datagram second = ReadAlStatus();
  second.circulating = true;
  const Bytes bytes = EncodeDatagrams({first, second});
  ASSERT_EQ(bytes.size(), 28U);
  EXPECT_EQ(LoadLe<std::uint16_t>(bytes, 6), 0x8002);
  EXPECT_EQ(LoadLe<std::uint16_t>(bytes, 14 + 6), 0x4002);
  const Bytes payload = EncodePayload({first, second});
  EXPECT_EQ(LoadLe<std::uint16_t>(payload, 0), 0x1000 + 28);
}

TEST(FrameBuilder, PaddingOfReturnedFrames) {
  EtherCatFrame frame;
  frame.datagrams = {ReadAlStatus()};
  EXPECT_EQ(EncodePacket(frame, {.minimum_bytes = 60}).size(), 60U);
}

TEST(FrameBuilder, VlanTags) {
  EtherCatFrame frame;
  frame.datagrams = {ReadAlStatus()};
  const Bytes one = EncodePacket(frame, {.vlan_tags = {0x2005}});
  EXPECT_THAT(Bytes(one.begin() + 12, one.begin() + 18), ElementsAreArray({0x81, 0x00, 0x20, 0x05, 0x88, 0xA4}));
  const Bytes two = EncodePacket(frame, {.vlan_tags = {0x0064, 0x0005}});
  EXPECT_THAT(Bytes(two.begin() + 12, two.begin() + 22),
              ElementsAreArray({0x88, 0xA8, 0x00, 0x64, 0x81, 0x00, 0x00, 0x05, 0x88, 0xA4}));
}

TEST(FrameBuilder, UdpHeaderAndItsChecksum) {
  EtherCatFrame frame;
  frame.datagrams = {ReadAlStatus()};
  const Bytes bytes = EncodePacket(frame, {.udp = true});
  ASSERT_EQ(bytes.size(), 14U + 28U + 16U);
  EXPECT_THAT(Bytes(bytes.begin() + 12, bytes.begin() + 14), ElementsAreArray({0x08, 0x00}));
  std::uint32_t sum = 0;
  for (std::size_t i = 14; i < 34; i += 2) sum += static_cast<std::uint32_t>(bytes[i] << 8) | bytes[i + 1];
  EXPECT_EQ((sum & 0xFFFFU) + (sum >> 16U), 0xFFFFU) << "IPv4 header checksum";
  EXPECT_EQ(bytes[36] * 256 + bytes[37], 34980);
  EXPECT_EQ(bytes[38] * 256 + bytes[39], 8 + 16);
}

TEST(FrameBuilder, CookedHeaders) {
  EtherCatFrame frame;
  frame.datagrams = {ReadAlStatus()};
  const Bytes v1 = EncodePacket(frame, {.link = Link::kCooked, .cooked_outgoing = true});
  EXPECT_THAT(Bytes(v1.begin(), v1.begin() + 16), ElementsAreArray({0x00, 0x04, 0x00, 0x01, 0x00, 0x06, 0x01, 0x01,
                                                                    0x01, 0x01, 0x01, 0x01, 0x00, 0x00, 0x88, 0xA4}));
  const Bytes v2 = EncodePacket(frame, {.link = Link::kCooked2, .cooked_interface = 7});
  EXPECT_THAT(Bytes(v2.begin(), v2.begin() + 20),
              ElementsAreArray({0x88, 0xA4, 0x00, 0x00, 0x00, 0x00, 0x00, 0x07, 0x00, 0x01,
                                0x01, 0x06, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x00, 0x00}));
}

TEST(FrameBuilder, EslRecordInFrontAndBehind) {
  EtherCatFrame frame;
  frame.datagrams = {ReadAlStatus()};
  const EslTag tag{.port = 1, .time_ns = 0x0102030405060708, .crc_error = true};
  const Bytes expected{0x01, 0x01, 0x05, 0x10, 0x00, 0x00, 0x40, 0x30, 0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01};
  const Bytes behind = EncodePacket(frame, {.esl = tag});
  ASSERT_EQ(behind.size(), 46U);
  EXPECT_THAT(Bytes(behind.end() - 16, behind.end()), ElementsAreArray(expected));
  EslTag in_front = tag;
  in_front.in_front = true;
  const Bytes front = EncodePacket(frame, {.esl = in_front});
  EXPECT_THAT(Bytes(front.begin(), front.begin() + 16), ElementsAreArray(expected));
}

TEST(FrameBuilder, SlavesSetTheLocalBit) {
  EXPECT_EQ(AfterSlave({0x01, 1, 1, 1, 1, 1})[0], 0x03);
}

}  // namespace
}  // namespace ecaudit::samples
