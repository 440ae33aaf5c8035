#include "samples/builder/capture_writer.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "samples/builder/frame_builder.h"

namespace ecaudit::samples {
namespace {

using ::testing::ElementsAreArray;

constexpr TimeNs kTime = 1'772'442'000'123'456'789;

WrittenCapture OnePacket(Bytes bytes) {
  WrittenCapture capture;
  capture.packets = {{.bytes = std::move(bytes), .time = kTime}};
  return capture;
}

// The field list of the pcap format: magic, 2.4, zone, accuracy, snap length, link type; seconds, fraction, lengths.
TEST(CaptureWriter, PcapByteForByte) {
  WrittenCapture capture = OnePacket({0xAA, 0xBB, 0xCC});
  capture.packets[0].original_length = 9;
  const std::uint32_t seconds = 1'772'442'000;
  Bytes expected{0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x00, 0x00, 0x04, 0x00, 1, 0, 0, 0};
  AppendLe(expected, seconds);
  AppendLe(expected, std::uint32_t{123'456});
  AppendBytes(expected, Bytes{3, 0, 0, 0, 9, 0, 0, 0, 0xAA, 0xBB, 0xCC});
  EXPECT_THAT(EncodePcap(capture, false), ElementsAreArray(expected));

  const Bytes big = EncodePcap(capture, true, ByteOrder::kBig);
  EXPECT_THAT(Bytes(big.begin(), big.begin() + 8), ElementsAreArray({0xA1, 0xB2, 0x3C, 0x4D, 0, 2, 0, 4}));
  Bytes stamp;
  AppendBe(stamp, seconds);
  AppendBe(stamp, std::uint32_t{123'456'789});
  EXPECT_THAT(Bytes(big.begin() + 24, big.begin() + 32), ElementsAreArray(stamp));
}

TEST(CaptureWriter, PcapNgBlocks) {
  WrittenCapture capture = OnePacket({0xAA, 0xBB, 0xCC});
  capture.packets[0].direction = PacketDirection::kOutbound;
  const Bytes file = EncodePcapNg(capture);
  // section header, interface description, enhanced packet: each begins and ends with its length
  std::vector<std::uint32_t> types;
  std::size_t at = 0;
  while (at < file.size()) {
    types.push_back(LoadLe<std::uint32_t>(file, at));
    const auto length = LoadLe<std::uint32_t>(file, at + 4);
    ASSERT_EQ(length % 4, 0U);
    ASSERT_LE(at + length, file.size());
    EXPECT_EQ(LoadLe<std::uint32_t>(file, at + length - 4), length);
    at += length;
  }
  EXPECT_THAT(types, ElementsAreArray({0x0A0D0D0AU, 1U, 6U}));
}

// ------------------------------------------------------------------------------------ second opinion: Wireshark

class WithWireshark : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v tshark > /dev/null") != 0) GTEST_SKIP() << "tshark is not installed";
    path_ = std::filesystem::temp_directory_path() / ("ecaudit_writer_" + std::to_string(getpid()));
  }
  void TearDown() override { std::filesystem::remove(path_); }

  /// One line a packet: the fields, divided by blanks; several values of a field by commas.
  std::vector<std::string> Fields(const Bytes& file, const std::string& fields) {
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()), static_cast<long>(file.size()));
    std::string command = "tshark -r '" + path_.string() + "' -T fields -E separator=/s";
    std::istringstream names(fields);
    for (std::string name; names >> name;) command += " -e " + name;
    std::string text;
    FILE* pipe = popen((command + " 2>/dev/null").c_str(), "r");
    if (pipe == nullptr) return {};
    char buffer[4096];
    while (const std::size_t got = fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, got);
    pclose(pipe);
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }

  std::filesystem::path path_;
};

std::vector<Datagram> AllCommands() {
  std::vector<Datagram> all;
  for (std::uint8_t command = 0; command <= 14; ++command) {
    Datagram d;
    d.command = static_cast<Cmd>(command);
    d.index = static_cast<std::uint8_t>(0x40 + command);
    d.adp = static_cast<std::uint16_t>(0x1001 + command);
    d.ado = static_cast<std::uint16_t>(0x1F00 + command);  // process RAM: no register dissection
    d.data = Bytes(command % 5U + 1U, static_cast<std::uint8_t>(0xA0 + command));
    d.wkc = command;
    all.push_back(d);
  }
  return all;
}

std::string Joined(const std::vector<Datagram>& datagrams, auto&& text) {
  std::string out;
  for (const Datagram& d : datagrams) out += (out.empty() ? "" : ",") + text(d);
  return out;
}

TEST_F(WithWireshark, AllCommandsInAllEncapsulations) {
  EtherCatFrame frame;
  frame.datagrams = AllCommands();
  const std::string expected =
      Joined(frame.datagrams, [](const Datagram& d) { return Hex(static_cast<unsigned>(d.command), 2); }) + " " +
      Joined(frame.datagrams, [](const Datagram& d) { return Hex(d.index, 2); }) + " " +
      Joined(frame.datagrams, [](const Datagram& d) { return std::to_string(d.data.size()); }) + " " +
      Joined(frame.datagrams, [](const Datagram& d) { return std::to_string(d.wkc); });
  const std::string fields = "ecat.cmd ecat.idx ecat.subframe.length ecat.cnt";
  for (const Encapsulation& around :
       {Encapsulation{}, Encapsulation{.vlan_tags = {0x2005}}, Encapsulation{.vlan_tags = {0x0064, 0x0005}},
        Encapsulation{.udp = true}, Encapsulation{.link = Link::kCooked}, Encapsulation{.link = Link::kCooked2}}) {
    WrittenCapture capture = OnePacket(EncodePacket(frame, around));
    capture.interfaces[0].link_type = LinkTypeNumber(around.link);
    const std::vector<std::string> lines = Fields(EncodePcapNg(capture), fields);
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_EQ(lines[0], expected) << "link type " << LinkTypeNumber(around.link) << ", VLAN tags "
                                  << around.vlan_tags.size() << ", UDP " << around.udp;
  }
}

TEST_F(WithWireshark, StampsInterfacesAndFlagsOfEveryContainer) {
  EtherCatFrame frame;
  frame.datagrams = {AllCommands().at(4)};
  WrittenCapture capture;
  capture.comment = "whole file";
  capture.interfaces = {{.name = "out", .resolution = 9}, {.name = "back", .resolution = 6, .dropped = 7}};
  capture.packets = {{.bytes = EncodePacket(frame), .time = kTime, .direction = PacketDirection::kOutbound},
                     {.bytes = EncodePacket(frame), .time = kTime, .interface_index = 1, .comment = "look"}};
  capture.packets[1].bytes.resize(25);
  capture.packets[1].original_length = 33;
  for (const ByteOrder order : {ByteOrder::kLittle, ByteOrder::kBig}) {
    const std::vector<std::string> ng = Fields(
        EncodePcapNg(capture, order), "frame.time_epoch frame.interface_name frame.cap_len frame.len frame.comment");
    ASSERT_EQ(ng.size(), 2U);
    EXPECT_EQ(ng[0], "1772442000.123456789 out 33 33 ");
    EXPECT_EQ(ng[1], "1772442000.123456000 back 25 33 look");
    EXPECT_EQ(Fields(EncodePcap(capture, true, order), "frame.time_epoch frame.cap_len").front(),
              "1772442000.123456789 33");
    EXPECT_EQ(Fields(EncodePcap(capture, false, order), "frame.time_epoch frame.len").back(),
              "1772442000.123456000 33");
  }
}

}  // namespace
}  // namespace ecaudit::samples
