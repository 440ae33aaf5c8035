#include "decoder/wire/frame_parser.h"

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"
#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

namespace fs = std::filesystem;

void ExpectSame(const FrameView& a, const FrameView& b, const std::string& what) {
  SCOPED_TRACE(what);
  EXPECT_EQ(a.kind(), b.kind());
  EXPECT_EQ(a.problem(), b.problem());
  EXPECT_EQ(a.ref(), b.ref());
  EXPECT_EQ(a.interface_index(), b.interface_index());
  EXPECT_EQ(a.flag(), b.flag());
  EXPECT_EQ(a.encapsulation(), b.encapsulation());
  EXPECT_EQ(a.vlan_tags(), b.vlan_tags());
  EXPECT_EQ(a.source_mac(), b.source_mac());
  EXPECT_EQ(a.ethercat_type(), b.ethercat_type());
  EXPECT_EQ(a.has_ethercat_header(), b.has_ethercat_header());
  EXPECT_EQ(a.cut_before_type(), b.cut_before_type());
  EXPECT_EQ(a.other_link(), b.other_link());
  EXPECT_EQ(a.padding(), b.padding());
  EXPECT_EQ(a.key(), b.key());
  EXPECT_EQ(a.esl().present, b.esl().present);
  EXPECT_EQ(a.esl().crc_error, b.esl().crc_error);
  EXPECT_EQ(a.esl().has_time, b.esl().has_time);
  EXPECT_EQ(a.esl().time_ns, b.esl().time_ns);
  EXPECT_EQ(a.esl().port, b.esl().port);
  EXPECT_EQ(a.bytes().data(), b.bytes().data());
  EXPECT_EQ(a.bytes().size(), b.bytes().size());
  EXPECT_TRUE(std::equal(a.offsets().begin(), a.offsets().end(), b.offsets().begin(), b.offsets().end()));
}

std::vector<fs::path> SampleCaptures() {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(fs::path(ecaudit::test::SourceDir()) / "samples" / "captures")) {
    if (entry.path().string().find(".pcap") != std::string::npos) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// However frames follow each other, and whatever is wrong with one of them.
TEST(FrameParser, CutsEachFrameAsIfItWereTheFirst) {
  std::mt19937 random(20261124);
  std::size_t frames = 0;
  for (const fs::path& path : SampleCaptures()) {
    auto opened = capture::OpenCapture(path.string());
    if (!opened) continue;
    FrameParser parser;
    capture::CapturedFrame frame;
    std::vector<std::uint8_t> bytes;
    for (int n = 0; n < 600 && (*opened)->Next(frame) == capture::ReadStatus::kFrame; ++n) {
      ++frames;
      ExpectSame(parser.Parse(frame), FrameView::Parse(frame), path.filename().string());
      // The same packet with some bits flipped, cut, longer, or marked as damaged.
      bytes.assign(frame.bytes.begin(), frame.bytes.end());
      if (bytes.empty()) continue;
      switch (random() % 6) {
        case 0:
          bytes.resize(random() % bytes.size());
          break;
        case 1:
          bytes.resize(bytes.size() + random() % 20);
          frame.original_length = static_cast<std::uint32_t>(bytes.size());
          break;
        case 2:
          frame.damaged = true;
          break;
        default:
          bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
          break;
      }
      frame.bytes = bytes;
      ExpectSame(parser.Parse(frame), FrameView::Parse(frame), path.filename().string() + ", damaged");
      ASSERT_FALSE(testing::Test::HasFailure()) << "frame " << frame.number;
    }
  }
  EXPECT_GT(frames, 5'000U);
}

/// A record of a probe may be behind one frame and not behind the next one, of the same length.
TEST(FrameParser, SeesTheRecordOfAProbeAfterAFrameOfAKnownShape) {
  Bytes plain = Plain(Payload(Datagrams({{.command = 12, .data = Bytes(40)}})));
  plain.resize(plain.size() + 16);
  Bytes recorded = plain;
  constexpr std::uint8_t kRecord[] = {0x01, 0x01, 0x05, 0x10, 0, 0, 0x00, 0x30, 1, 2, 3, 4, 5, 6, 7, 8};
  std::copy(std::begin(kRecord), std::end(kRecord), recorded.end() - sizeof kRecord);
  FrameParser parser;
  for (const Bytes* bytes : {&plain, &recorded, &plain, &recorded}) {
    const capture::CapturedFrame frame = Captured(*bytes);
    const FrameView& view = parser.Parse(frame);
    EXPECT_EQ(view.esl().present, bytes == &recorded);
    ExpectSame(view, FrameView::Parse(frame), bytes == &recorded ? "with a record" : "plain");
  }
}

}  // namespace
}  // namespace ecaudit::wire::test
