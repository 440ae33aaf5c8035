/// Law: a tap whose two interfaces have clocks of their own shows what it shows with one clock. What went out is put on
/// one interface, what came back on another whose clock is apart; the packets stand in the order of the wire or in that
/// of their stamps.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "decoder/bus/aligned_source.h"
#include "decoder/wire/frame_view.h"
#include "tests/property/captures.h"
#include "tests/property/wire_packets.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

struct Clock {
  const char* name;
  std::int64_t ahead_ns;
  std::int64_t ppm;
  bool sorted;  ///< by stamps
};

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr Clock kClocks[] = {
    {"2 ms ahead", 2'000'000, 0, false},
    {"37 s behind", -37 * kSecond, 0, false},
    {"an hour ahead and 30 ppm fast", 3600 * kSecond, 30, false},
    {"0.3 ms behind, sorted", -300'000, 0, true},
    {"2 ms ahead, sorted", 2'000'000, 0, true},
    {"37 s behind, sorted", -37 * kSecond, 0, true},
    {"an hour ahead and 30 ppm slow, sorted", 3600 * kSecond, -30, true},
};
constexpr std::size_t kMostOfATap = 30'000;
constexpr std::size_t kClocksForEach = 3;

/// Nothing where the capture is none of a tap: the bit that slaves set does not tell what came back, a clock was set in
/// it, or stamps are missing.
std::vector<test::Packet> OnTwoInterfaces(const test::WireCapture& capture) {
  std::vector<test::Packet> packets = capture.packets;
  std::size_t returned = 0;
  TimeNs last = packets.empty() ? 0 : packets.front().time;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    test::Packet& packet = packets[i];
    if (!packet.has_time || packet.time < last || ClockJumps(last, packet.time)) return {};
    last = packet.time;
    const capture::CapturedFrame frame = test::AsCaptured(packet, i + 1);
    const wire::FrameView view = wire::FrameView::Parse(frame);
    const bool back = view.kind() != wire::FrameKind::kOther && view.mac_bit();
    packet.interface_index = back ? 1 : 0;
    returned += back ? 1U : 0U;
  }
  if (returned == 0 || returned * 10 > packets.size() * 9) return {};
  return packets;
}

std::vector<test::Packet> Apart(std::vector<test::Packet> packets, const Clock& clock) {
  const TimeNs start = packets.front().time;
  for (test::Packet& packet : packets) {
    if (packet.interface_index == 0) continue;
    packet.time += clock.ahead_ns + (packet.time - start) / 1'000'000 * clock.ppm;
  }
  if (clock.sorted) {
    std::stable_sort(packets.begin(), packets.end(),
                     [](const test::Packet& a, const test::Packet& b) { return a.time < b.time; });
  }
  return packets;
}

/// How often each rule fired, for each slave and severity.
using Findings = std::map<std::tuple<std::string, SlaveId, int>, std::uint64_t>;

/// @param said  rules that could not be evaluated
Findings FindingsOf(const std::vector<test::Packet>& packets, const capture::CaptureInfo& info, bool& moved,
                    std::set<std::string>* said = nullptr) {
  auto source = bus::OpenAligned([&]() -> Result<std::unique_ptr<capture::FrameSource>> {
    return std::unique_ptr<capture::FrameSource>(std::make_unique<test::MemorySource>(packets, info));
  });
  EXPECT_TRUE(source);
  moved = (*source)->info().clock_shift.has_value();
  const AnalysisResult result = Analyse(**source, {});
  for (const NotEvaluable& n : result.not_evaluable) {
    if (said != nullptr) said->insert(std::string(n.rule));
  }
  Findings findings;
  for (const Finding& f : result.findings) {
    if (f.rule.starts_with("capture-")) continue;  // about the file
    // Of the damaged packets of a file, whose own side is not known, a few more or less are called lost.
    if (f.severity == Severity::kInfo && f.rule.starts_with("frame-")) continue;
    findings[{std::string(f.rule), f.slave, static_cast<int>(f.severity)}] += f.count;
  }
  return findings;
}

TEST(InterfaceClocks, ApartOrNotChangeNoFinding) {
  std::vector<fs::path> captures = test::CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures");
  for (const char* folder : {"real", "lab"}) {
    const auto more = test::CapturesIn(fs::path(test::SharedDir()) / "captures" / folder);
    captures.insert(captures.end(), more.begin(), more.end());
  }
  std::size_t tried = 0;
  std::size_t times_moved = 0;
  for (const fs::path& path : captures) {
    const auto capture = test::LoadCapture(path);
    ASSERT_TRUE(capture) << path;
    if (capture->packets.size() > kMostOfATap || capture->packets.size() < 64) continue;
    const std::vector<test::Packet> packets = OnTwoInterfaces(*capture);
    if (packets.empty()) continue;
    bool moved = false;
    const Findings together = FindingsOf(packets, capture->info, moved);
    EXPECT_FALSE(moved) << path;
    for (std::size_t i = 0; i < kClocksForEach; ++i) {
      const Clock& clock = kClocks[(tried * kClocksForEach + i) % std::size(kClocks)];
      SCOPED_TRACE(path.filename().string() + ", " + clock.name);
      std::set<std::string> said;
      const Findings apart = FindingsOf(Apart(packets, clock), capture->info, moved, &said);
      Findings expected = together;
      // A master that leaves out numbers, and returns that are not all in their place: frames may be missing as well.
      if (path.filename() == "numbers-left-out.pcapng") {
        std::erase_if(expected,
                      [&](const auto& f) { return !apart.contains(f.first) && said.contains(std::get<0>(f.first)); });
      }
      EXPECT_EQ(apart, expected);
      times_moved += moved ? 1U : 0U;
    }
    ++tried;
  }
  EXPECT_GT(tried, 10U);
  // Where all frames look alike their returns may fit to one clock as well.
  EXPECT_GT(times_moved, tried * kClocksForEach * 9 / 10);
}

}  // namespace
}  // namespace ecaudit
