/// Law: whatever flipped bits, tags here and there and cycles that come again and again make of a capture, all packets
/// are read, each frame ends in one way, and the report is whole: all that it refers to is in it.
#include <filesystem>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "analyzers/analysis.h"
#include "cli/report/json_writer.h"
#include "cli/report/report.h"
#include "tests/property/captures.h"
#include "tests/property/wire_packets.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using test::Packet;
using test::WireCapture;

/// A bit here and there is another one.
std::vector<Packet> WithFlippedBits(const WireCapture& capture, unsigned seed) {
  constexpr std::size_t kHeader = 26;  // Ethernet, EtherCAT and the first of a datagram
  std::mt19937 random(seed);
  std::vector<Packet> packets = capture.packets;
  for (Packet& packet : packets) {
    if (random() % 300 != 0 || packet.bytes.size() <= kHeader) continue;
    packet.bytes[kHeader + random() % (packet.bytes.size() - kHeader)] ^=
        static_cast<std::uint8_t>(1U << random() % 8U);
  }
  return packets;
}

/// A packet here and there has a VLAN tag: what it carries begins later in it.
std::vector<Packet> WithTags(const WireCapture& capture, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Packet> packets = capture.packets;
  for (Packet& packet : packets) {
    if (random() % 40 != 0 || packet.link_type != 1 || packet.bytes.size() < 14) continue;
    constexpr std::uint8_t kTag[] = {0x81, 0x00, 0x60, 0x05};
    packet.bytes.insert(packet.bytes.begin() + 12, std::begin(kTag), std::end(kTag));
    if (packet.original_length != 0) packet.original_length += sizeof kTag;
  }
  return packets;
}

/// Every cycle a dozen times, as in a run that lasts longer.
std::vector<Packet> Lasting(const WireCapture& capture) {
  constexpr std::size_t kMost = 4'000;
  constexpr int kTimes = 12;
  std::vector<Packet> packets;
  for (std::size_t i = 0; i < capture.packets.size() && packets.size() < kMost; i += 2) {
    const std::size_t end = std::min(i + 2, capture.packets.size());
    const auto part = test::FindEtherCat(capture.packets[i]);
    for (int n = 0; n < (part && part->cyclic ? kTimes : 1); ++n) {
      packets.insert(packets.end(), capture.packets.begin() + static_cast<std::ptrdiff_t>(i),
                     capture.packets.begin() + static_cast<std::ptrdiff_t>(end));
    }
  }
  // Later by a microsecond each, so that no stamp comes twice.
  for (std::size_t i = 0; i < packets.size(); ++i) packets[i].time += static_cast<TimeNs>(i) * 1'000;
  return packets;
}

void CheckThat(const WireCapture& capture, const std::string& how, const std::vector<Packet>& packets) {
  SCOPED_TRACE(capture.name + ", " + how);
  test::MemorySource source(packets, capture.info);
  report::Report report;
  AnalysisResult& result = report.captures.emplace_back().result;
  result = Analyse(source, {});
  EXPECT_EQ(result.capture.packets, packets.size());
  EXPECT_TRUE(result.capture.frames.Balances());

  const nlohmann::json json = nlohmann::json::parse(report::WriteJson(report), nullptr, false);
  ASSERT_FALSE(json.is_discarded());
  const nlohmann::json& one = json["reports"][0];
  std::set<std::string> ids;
  for (const nlohmann::json& finding : one["findings"]) {
    EXPECT_TRUE(ids.insert(finding["id"]).second);
    EXPECT_LE(finding["frame"], packets.size());
    EXPECT_LE(finding["frame"], finding["last_frame"]);
  }
  for (const nlohmann::json& finding : one["findings"]) {
    if (!finding["caused_by"].is_null()) EXPECT_TRUE(ids.contains(finding["caused_by"])) << finding["caused_by"];
  }
  for (const nlohmann::json& slave : one["slaves"]) {
    for (const nlohmann::json& rung : slave["progress"]) {
      if (!rung["finding"].is_null()) EXPECT_TRUE(ids.contains(rung["finding"])) << rung["finding"];
    }
  }
}

class DamagedPacketsTest : public testing::TestWithParam<const char*> {};

TEST_P(DamagedPacketsTest, AreReadToTheEnd) {
  const std::string folder = GetParam();
  const fs::path path = folder == "samples" ? fs::path(test::SourceDir()) / "samples" / "captures"
                                            : fs::path(test::SharedDir()) / "captures" / folder;
  const std::vector<fs::path> captures = test::CapturesIn(path);
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  unsigned seed = 0;
  for (const fs::path& one : captures) {
    const auto capture = test::LoadCapture(one);
    ASSERT_TRUE(capture) << one;
    ++seed;
    CheckThat(*capture, "with flipped bits", WithFlippedBits(*capture, seed));
    CheckThat(*capture, "with tags", WithTags(*capture, seed));
    CheckThat(*capture, "lasting longer", Lasting(*capture));
  }
}

INSTANTIATE_TEST_SUITE_P(All, DamagedPacketsTest, testing::Values("samples", "real", "lab"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace ecaudit
