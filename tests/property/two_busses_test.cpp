/// Law: what another machine does on another interface changes no finding. Two captures are put into one file, each on
/// an interface of its own, the second one with another master's address and begun at another moment.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "tests/property/captures.h"
#include "tests/property/wire_packets.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostOfOneBus = 15'000;
constexpr TimeNs kLater[] = {0, 100'000'000, -100'000'000, 2'000'000};

/// Of each severity, rule and slave.
using Found = std::map<std::tuple<int, std::string, SlaveId>, std::uint64_t>;

struct Judgement {
  Found found;
  bool limited = false;
};

Judgement JudgementOf(const std::vector<test::Packet>& packets) {
  test::MemorySource source(packets);
  const AnalysisResult result = Analyse(source, {});
  Judgement judgement;
  for (const Finding& f : result.findings) {
    if (f.rule.starts_with("capture-") || f.severity == Severity::kInfo) continue;  // about the file
    judgement.found[{static_cast<int>(f.severity), std::string(f.rule), f.slave}] += f.count;
  }
  judgement.limited = !result.cut.empty();
  return judgement;
}

/// Both copies on one interface, of plain Ethernet, with time stamps that go on.
bool IsWholeBus(const test::WireCapture& capture) {
  std::size_t returned = 0;
  TimeNs last = capture.packets.empty() ? 0 : capture.packets.front().time;
  for (const test::Packet& packet : capture.packets) {
    if (!packet.has_time || packet.interface_index != 0 || packet.link_type != 1) return false;
    if (packet.time < last || packet.time - last > 600'000'000'000) return false;
    last = packet.time;
    if (packet.bytes.size() > 6 && (packet.bytes[6] & 2U) != 0) ++returned;
  }
  return capture.packets.size() >= 100 && capture.packets.size() <= kMostOfOneBus &&
         returned * 5 >= capture.packets.size() * 2 && returned * 5 <= capture.packets.size() * 3;
}

/// Also if only the frames before it show what the length in its header counts.
bool HasEtherCatType(const test::Packet& packet) {
  return packet.bytes.size() > 14 && packet.bytes[12] == 0x88 && packet.bytes[13] == 0xA4;
}

std::vector<test::Packet> OnAnotherInterface(const test::WireCapture& capture, TimeNs start) {
  std::vector<test::Packet> packets = capture.packets;
  const TimeNs shift = start - packets.front().time;
  for (test::Packet& packet : packets) {
    packet.interface_index = 1;
    packet.time += shift;
    if (HasEtherCatType(packet) || test::FindEtherCat(packet)) packet.bytes[11] ^= 0x5AU;
  }
  return packets;
}

TEST(TwoBusses, OnTwoInterfacesAreEvaluatedAsOneEach) {
  std::vector<fs::path> paths = test::CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures");
  const auto lab = test::CapturesIn(fs::path(test::SharedDir()) / "captures" / "lab");
  paths.insert(paths.end(), lab.begin(), lab.end());
  std::vector<test::WireCapture> captures;
  for (const fs::path& path : paths) {
    auto capture = test::LoadCapture(path);
    ASSERT_TRUE(capture) << path;
    if (IsWholeBus(*capture)) captures.push_back(std::move(*capture));
  }
  ASSERT_GT(captures.size(), 20U);
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const test::WireCapture& one = captures[i];
    const test::WireCapture& other = captures[(i + captures.size() / 3) % captures.size()];
    SCOPED_TRACE(one.name + " beside " + other.name);
    std::vector<test::Packet> packets = one.packets;
    const auto second = OnAnotherInterface(other, packets.front().time + kLater[i % std::size(kLater)]);
    packets.insert(packets.end(), second.begin(), second.end());
    std::stable_sort(packets.begin(), packets.end(),
                     [](const test::Packet& a, const test::Packet& b) { return a.time < b.time; });
    const Judgement both = JudgementOf(packets);
    // The bus is the one of which more is seen at the beginning.
    const Found first_alone = JudgementOf(one.packets).found;
    if (both.found != first_alone) {
      EXPECT_EQ(both.found, JudgementOf(other.packets).found);
    }
    EXPECT_TRUE(both.limited) << "a bus was not judged";
  }
}

}  // namespace
}  // namespace ecaudit
