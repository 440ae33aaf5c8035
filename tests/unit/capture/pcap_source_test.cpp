#include "decoder/capture/pcap_source.h"

#include <cstdio>
#include <random>

#include <gtest/gtest.h>
#include <pcap/pcap.h>

#include "decoder/capture/capture_stream.h"
#include "tests/unit/capture/pcapng_bytes.h"

namespace ecaudit::capture {
namespace {

const Bytes kPcapSourceData{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
constexpr std::uint32_t kMicroseconds = 0xA1B2C3D4;
constexpr std::uint32_t kNanoseconds = 0xA1B23C4D;

class PcapBytes {
 public:
  explicit PcapBytes(std::uint32_t magic, bool big_endian = false, std::uint32_t link_type = 1,
                     std::uint32_t snap_length = 65535, std::uint16_t major = 2)
      : order_(big_endian) {
    bytes_ = PcapngBytes::Join(
        {U32(magic), order_.U16(major), order_.U16(4), U32(0), U32(0), U32(snap_length), U32(link_type)});
  }
  PcapBytes& Packet(std::uint32_t seconds, std::uint32_t fraction, const Bytes& data, std::uint32_t original = 0) {
    const auto length = static_cast<std::uint32_t>(data.size());
    return Raw(
        PcapngBytes::Join({U32(seconds), U32(fraction), U32(length), U32(original == 0 ? length : original), data}));
  }
  PcapBytes& Raw(const Bytes& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  [[nodiscard]] Bytes U32(std::uint32_t value) const { return order_.U32(value); }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  PcapngBytes order_;
  Bytes bytes_;
};

WholeCapture ReadPcap(const Bytes& file) {
  return ReadAll(OpenCaptureFromMemory(file, "x"));
}

TEST(Pcap, MicroAndNanosecondsInBothByteOrders) {
  for (const bool big_endian : {false, true}) {
    for (const std::uint32_t magic : {kMicroseconds, kNanoseconds}) {
      PcapBytes file(magic, big_endian, 113, 128);
      file.Packet(1'795'230'943, 188'860, kPcapSourceData, 60).Packet(1'795'230'944, 0, kPcapSourceData);
      const WholeCapture capture = ReadPcap(file.bytes());
      ASSERT_EQ(capture.frames.size(), 2U) << capture.error << capture.damage();
      const TimeNs step = magic == kNanoseconds ? 1 : 1000;
      EXPECT_EQ(capture.frames[0].time, 1'795'230'943'000'000'000 + 188'860 * step);
      EXPECT_TRUE(capture.frames[0].has_time);
      EXPECT_EQ(capture.frames[0].number, 1U);
      EXPECT_EQ(capture.frames[0].bytes, kPcapSourceData);
      EXPECT_EQ(capture.frames[0].original_length, 60U);
      EXPECT_EQ(capture.frames[0].link_type, 113);
      EXPECT_EQ(capture.frames[1].number, 2U);
      EXPECT_EQ(capture.end, ReadStatus::kEnd);
      EXPECT_EQ(capture.info.format, "pcap");
      ASSERT_EQ(capture.info.interfaces.size(), 1U);
      EXPECT_EQ(capture.info.interfaces[0].link_type, 113);
      EXPECT_EQ(capture.info.interfaces[0].snap_length, 128U);
      EXPECT_EQ(capture.info.interfaces[0].resolution_ns, step);
    }
  }
}

TEST(Pcap, InterfaceIsKnownBeforeTheFirstPacket) {
  const PcapBytes file(kNanoseconds);
  const auto source = OpenCaptureFromMemory(file.bytes(), "x");
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->info().interfaces.size(), 1U);
}

TEST(Pcap, AnyLinkTypeIsPassedThroughWithTheNumberOfTheFile) {
  // 101 is LINKTYPE_RAW, which libpcap itself renames to DLT_RAW (12); 4095 nobody knows; the top bits are the FCS
  // length.
  for (const std::uint32_t link_type : {1U, 101U, 276U, 4095U, 1U | 0x24000000U}) {
    const WholeCapture capture =
        ReadPcap(PcapBytes(kMicroseconds, false, link_type).Packet(1, 1, kPcapSourceData).bytes());
    ASSERT_EQ(capture.frames.size(), 1U) << link_type << capture.error;
    EXPECT_EQ(capture.frames[0].link_type, link_type & 0xFFFFU);
  }
}

TEST(Pcap, SecondsBeyond2038AreUnsigned) {
  const WholeCapture capture =
      ReadPcap(PcapBytes(kNanoseconds).Packet(0xFFFFFFFF, 999'999'999, kPcapSourceData).bytes());
  ASSERT_EQ(capture.frames.size(), 1U);
  EXPECT_EQ(capture.frames[0].time, 4'294'967'295'999'999'999);
}

TEST(Pcap, PacketsBeyondTheSnapLengthOfTheFileAreWhole) {
  for (const std::uint32_t snap_length : {0U, 8U, 0xFFFFFFFFU}) {
    const WholeCapture capture =
        ReadPcap(PcapBytes(kMicroseconds, true, 1, snap_length).Packet(1, 1, kPcapSourceData).bytes());
    ASSERT_EQ(capture.frames.size(), 1U) << snap_length << capture.error;
    EXPECT_EQ(capture.frames[0].bytes, kPcapSourceData) << snap_length;
    EXPECT_EQ(capture.info.interfaces[0].snap_length, snap_length);
  }
}

TEST(Pcap, NoPacketIsAnEmptyCapture) {
  const WholeCapture capture = ReadPcap(PcapBytes(kMicroseconds).bytes());
  EXPECT_EQ(capture.error, "");
  EXPECT_TRUE(capture.frames.empty());
  EXPECT_EQ(capture.end, ReadStatus::kEnd);
}

TEST(Pcap, CutAtAnyByteEndsInsideTheNextPacketOrAtTheEnd) {
  const PcapBytes header(kMicroseconds);
  PcapBytes file = header;
  file.Packet(1, 1, kPcapSourceData).Packet(2, 2, kPcapSourceData).Packet(3, 3, kPcapSourceData);
  const std::size_t header_size = header.bytes().size();
  const std::size_t packet_size = 16 + kPcapSourceData.size();
  for (std::size_t length = 0; length < file.bytes().size(); ++length) {
    const WholeCapture capture =
        ReadPcap(Bytes(file.bytes().begin(), file.bytes().begin() + static_cast<std::ptrdiff_t>(length)));
    if (length < header_size) {
      EXPECT_NE(capture.error, "") << length;
      continue;
    }
    const std::size_t whole = (length - header_size) / packet_size;
    ASSERT_EQ(capture.frames.size(), whole) << length;
    if ((length - header_size) % packet_size == 0) {
      EXPECT_EQ(capture.end, ReadStatus::kEnd) << length;
      continue;
    }
    EXPECT_EQ(capture.damage(), "file ends inside packet " + std::to_string(whole + 1)) << length;
    ASSERT_TRUE(capture.info.damage.has_value());
    EXPECT_EQ(capture.info.damage->offset, header_size + whole * packet_size);
    EXPECT_EQ(capture.info.damage->after_frame, whole);
  }
}

TEST(Pcap, ImpossibleCapturedLengthIsDamageOfThatPacket) {
  PcapBytes file(kMicroseconds);
  file.Packet(1, 1, kPcapSourceData);
  file.Raw(PcapngBytes::Join({file.U32(2), file.U32(2), file.U32(0xFFFFFFF0), file.U32(60)})).Raw(Bytes(100));
  const WholeCapture capture = ReadPcap(file.bytes());
  EXPECT_EQ(capture.frames.size(), 1U);
  EXPECT_TRUE(capture.damage().starts_with("packet 2 is not valid (")) << capture.damage();
}

TEST(Pcap, BadFileHeadersDoNotOpen) {
  PcapBytes good(kMicroseconds);
  EXPECT_EQ(ReadPcap(Bytes(good.bytes().begin(), good.bytes().begin() + 23)).error,
            "x is not a readable capture: file ends inside its pcap file header");
  const std::string error = ReadPcap(PcapBytes(kMicroseconds, false, 1, 65535, 9).bytes()).error;
  EXPECT_TRUE(error.starts_with("x is not a readable capture: ")) << error;
  EXPECT_NE(error.find("version"), std::string::npos) << error;
}

TEST(Pcap, CompressedAndCutNamesTheCompression) {
  PcapBytes file(kMicroseconds);
  for (std::uint32_t i = 0; i < 5000; ++i) file.Packet(i, i * 77 % 1'000'000, kPcapSourceData);
  const Bytes whole = Gzip(file.bytes());
  const WholeCapture good = ReadPcap(whole);
  EXPECT_EQ(good.frames.size(), 5000U);
  EXPECT_EQ(good.end, ReadStatus::kEnd);
  EXPECT_EQ(good.info.format, "pcap+gzip");
  const WholeCapture cut =
      ReadPcap(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(whole.size() / 2)));
  EXPECT_GT(cut.frames.size(), 1000U);
  EXPECT_LT(cut.frames.size(), 5000U);
  EXPECT_EQ(cut.damage(), "the gzip data end early, after packet " + std::to_string(cut.frames.size()));
}

TEST(Pcap, WrongChecksumAfterTheLastPacketIsDamage) {
  Bytes gzip = Gzip(PcapBytes(kMicroseconds).Packet(1, 1, kPcapSourceData).bytes());
  gzip[gzip.size() - 6] ^= 1U;
  const WholeCapture capture = ReadPcap(gzip);
  EXPECT_EQ(capture.frames.size(), 1U);
  EXPECT_EQ(capture.damage(), "the gzip data are damaged (incorrect data check), after packet 1");
}

/// What libpcap's own loop makes of a file.
struct ByLibpcap {
  std::vector<Bytes> packets;
  std::vector<std::uint32_t> original;
  std::vector<TimeNs> times;
  bool opens = false;
  bool damaged = false;
};

ByLibpcap ReadByLibpcap(Bytes file) {
  // libpcap cuts packets to the snap length of the file header, which some writers exceed.
  std::fill_n(file.begin() + 16, 4, std::uint8_t{0});
  ByLibpcap read;
  char message[PCAP_ERRBUF_SIZE] = {};
  FILE* memory = fmemopen(file.data(), file.size(), "rb");
  pcap_t* pcap = pcap_fopen_offline_with_tstamp_precision(memory, PCAP_TSTAMP_PRECISION_NANO, message);
  if (pcap == nullptr) {
    std::fclose(memory);
    return read;
  }
  read.opens = true;
  pcap_pkthdr* header = nullptr;
  const u_char* bytes = nullptr;
  int result = 0;
  while ((result = pcap_next_ex(pcap, &header, &bytes)) == 1) {
    read.packets.emplace_back(bytes, bytes + header->caplen);
    read.original.push_back(header->len);
    read.times.push_back(TimeNs{static_cast<std::uint32_t>(header->ts.tv_sec)} * 1'000'000'000 + header->ts.tv_usec);
  }
  read.damaged = result != PCAP_ERROR_BREAK;
  pcap_close(pcap);
  return read;
}

void ExpectAsLibpcap(const Bytes& file, const std::string& what) {
  const ByLibpcap expected = ReadByLibpcap(file);
  const WholeCapture capture = ReadPcap(file);
  ASSERT_EQ(capture.error.empty(), expected.opens) << what << capture.error;
  ASSERT_EQ(capture.frames.size(), expected.packets.size()) << what << capture.damage();
  EXPECT_EQ(capture.info.damage.has_value(), expected.damaged) << what << capture.damage();
  for (std::size_t i = 0; i < expected.packets.size(); ++i) {
    ASSERT_EQ(capture.frames[i].bytes, expected.packets[i]) << what << i;
    ASSERT_EQ(capture.frames[i].original_length, expected.original[i]) << what << i;
    // A fraction that damage made greater than a second is above or below 0 to libpcap, by the byte order of the file.
    const TimeNs turn = (TimeNs{1} << 32U) * capture.info.interfaces[0].resolution_ns;
    ASSERT_EQ((capture.frames[i].time - expected.times[i]) % turn, 0) << what << i;
  }
}

TEST(Pcap, ReadsWhatLibpcapReads) {
  std::mt19937 random(20261123);
  for (const bool big_endian : {false, true}) {
    for (const std::uint32_t magic : {kMicroseconds, kNanoseconds, 0xA1B2CD34U}) {
      for (const int minor : {4, 3, 2, 0, 5}) {
        PcapBytes file(magic, big_endian, 1, 65535);
        for (std::uint32_t i = 0; i < 12; ++i) {
          const Bytes data(random() % 90, static_cast<std::uint8_t>(i));
          const auto length = static_cast<std::uint32_t>(data.size());
          const std::uint32_t other = length + random() % 3;
          const bool turned = minor < 4 && random() % 2 == 0;
          file.Raw(PcapngBytes::Join({file.U32(1'700'000'000 + i), file.U32(random() % 1'000'000),
                                      file.U32(turned ? other : length), file.U32(turned ? length : other)}));
          if (magic == 0xA1B2CD34U) file.Raw(Bytes(8, 0x55));  // interface index, protocol, packet type
          file.Raw(data);
        }
        Bytes bytes = file.bytes();
        bytes[big_endian ? 7 : 6] = static_cast<std::uint8_t>(minor);
        ExpectAsLibpcap(bytes, "minor version " + std::to_string(minor) + ": ");
        for (int damage = 0; damage < 60; ++damage) {
          Bytes damaged = bytes;
          damaged[24 + random() % (damaged.size() - 24)] = static_cast<std::uint8_t>(random());
          if (damage % 3 == 0) damaged.resize(24 + random() % (damaged.size() - 24));
          ExpectAsLibpcap(damaged, "damage " + std::to_string(damage) + ": ");
        }
      }
    }
  }
}

}  // namespace
}  // namespace ecaudit::capture
