/// Law: cycles that tell nothing new need not be told in full. Whether they are or not, each report is the same to the
/// last byte: of every capture, and of what flipped bits, missing packets and faults in the middle of a run make of it.
#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/observation.h"
#include "cli/report/json_writer.h"
#include "cli/report/report.h"
#include "decoder/track/events.h"
#include "tests/property/captures.h"
#include "tests/property/zoo.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using samples::Story;
using test::Packet;
using test::WireCapture;

std::string ReportOn(const std::vector<Packet>& packets, const capture::CaptureInfo& info, bool tells_each_cycle) {
  test::MemorySource source(packets, info);
  AnalysisOptions options;
  options.tells_each_cycle = tells_each_cycle;
  report::Report report;
  report.captures.emplace_back().result = Analyse(source, options);
  return report::WriteJson(report);
}

void CheckThat(const WireCapture& capture, const std::string& how, const std::vector<Packet>& packets) {
  const std::string in_full = ReportOn(packets, capture.info, true);
  const std::string in_short = ReportOn(packets, capture.info, false);
  const auto at = std::mismatch(in_full.begin(), in_full.end(), in_short.begin(), in_short.end()).first;
  const auto where = static_cast<std::size_t>(at - in_full.begin());
  const std::size_t from = where - std::min<std::size_t>(where, 300);
  EXPECT_TRUE(in_full == in_short) << capture.name << ", " << how << ": told in full\n"
                                   << in_full.substr(from, 500) << "\nand in short\n"
                                   << in_short.substr(std::min(from, in_short.size()), 500);
}

/// A bit here and there is another one, or a packet is missing.
std::vector<Packet> Damaged(const WireCapture& capture, unsigned seed, unsigned one_in, bool drop) {
  std::mt19937 random(seed);
  std::vector<Packet> packets;
  for (const Packet& packet : capture.packets) {
    const bool hit = random() % one_in == 0;
    if (hit && drop) continue;
    packets.push_back(packet);
    constexpr std::size_t kHeader = 26;  // Ethernet, EtherCAT and the first of a datagram
    std::vector<std::uint8_t>& bytes = packets.back().bytes;
    if (!hit || bytes.size() <= kHeader) continue;
    bytes[kHeader + random() % (bytes.size() - kHeader)] ^= static_cast<std::uint8_t>(1U << random() % 8);
  }
  return packets;
}

class RepeatedCyclesTest : public testing::TestWithParam<const char*> {};

TEST_P(RepeatedCyclesTest, MakeNoDifference) {
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
    CheckThat(*capture, "as it is", capture->packets);
    CheckThat(*capture, "with flipped bits", Damaged(*capture, seed, 300, false));
    CheckThat(*capture, "with missing packets", Damaged(*capture, seed, 300, true));
  }
}

INSTANTIATE_TEST_SUITE_P(All, RepeatedCyclesTest, testing::Values("samples", "real", "lab"),
                         [](const testing::TestParamInfo<const char*>& folder) { return std::string(folder.param); });

/// Two drives in operation.
void PlayAtRest(Story& story) {
  story.Add(samples::AkdDrive());
  story.Add(samples::AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.SetUpClocks(4);
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = 2 * samples::kMs, .distributes_time = true, .reads_al_status = true});
  story.master.Cycles(60);
}

TEST(RepeatedCycles, MakeNoDifferenceUnderAnyMaster) {
  unsigned seed = 0;
  for (const test::ZooMaster& one : test::ZooMasters(10)) {
    Story story(one.way);
    PlayAtRest(story);
    for (const int cycle : {3, 11, 12, 40}) story.master.ChangeCycle(story.master.next_cycle() + cycle, {.lose = true});
    story.master.Cycles(80);
    const WireCapture capture = test::CaptureOf(story, one.name);
    CheckThat(capture, "with lost frames", capture.packets);
    CheckThat(capture, "with flipped bits", Damaged(capture, ++seed, 50, false));
  }
}

/// How a run was told; every cycle distributes the time.
struct Told {
  std::uint64_t in_full = 0;
  std::uint64_t in_short = 0;
  std::uint64_t skipped = 0;  ///< as said behind them

  void On(const track::LogicalAccess&) { ++in_full; }
  void On(const track::TimeRepeated&) { ++in_short; }
  void On(const track::CyclesSkipped& cycles) { skipped += cycles.count; }
};

TEST(RepeatedCycles, AreNotToldInFull) {
  Story story;
  PlayAtRest(story);
  story.master.Cycles(200);
  WireCapture capture = test::CaptureOf(story, "at rest");
  const AnalysisOptions options;
  for (const bool skips : {false, true}) {
    Observation observation(options, Depth::kClocks);
    Told told;
    observation.bus().ListenTo<track::LogicalAccess, track::TimeRepeated, track::CyclesSkipped>(Stage::kBeforeModel,
                                                                                                told);
    if (skips) observation.SkipRepeatedCycles();
    test::MemorySource source(capture.packets, capture.info);
    observation.Run(source, {});
    if (!skips) {
      EXPECT_GT(told.in_full, 250U);
      EXPECT_EQ(told.in_short, 0U);
      continue;
    }
    EXPECT_LT(told.in_full, 60U);
    EXPECT_GT(told.in_short, 200U);
    // Of each run the last is told in full, too.
    EXPECT_LT(told.skipped, told.in_short);
    EXPECT_GT(told.skipped + 20, told.in_short);
  }
}

TEST(RepeatedCycles, AreToldInFullWhereSomebodyWantsThat) {
  Story story;
  PlayAtRest(story);
  story.master.Cycles(20);
  WireCapture capture = test::CaptureOf(story, "wanted");
  const AnalysisOptions options;
  Observation observation(options, Depth::kClocks);
  struct Veto {
    std::uint64_t asked = 0;
    void On(const track::CycleAtRest& rest) {
      ++asked;
      rest.each_wanted = true;
    }
  } veto;
  Told told;
  observation.bus().ListenTo<track::CycleAtRest>(Stage::kAfterModel, veto);
  observation.bus().ListenTo<track::LogicalAccess, track::TimeRepeated, track::CyclesSkipped>(Stage::kBeforeModel,
                                                                                              told);
  observation.SkipRepeatedCycles();
  test::MemorySource source(capture.packets, capture.info);
  observation.Run(source, {});
  EXPECT_GT(veto.asked, 0U);
  EXPECT_EQ(told.in_short, 0U);
  EXPECT_EQ(told.skipped, 0U);
}

}  // namespace
}  // namespace ecaudit
