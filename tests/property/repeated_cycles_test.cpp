/// Law: cycles that tell nothing new need not be told in full. Whether they are or not, each report is the same to the
/// last byte: of every capture, and of what flipped bits, missing packets and faults in the middle of a run make of it.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/observation.h"
#include "analyzers/sync/sync_model.h"
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

/// A packet here and there has a VLAN tag: what it carries lies elsewhere in it.
std::vector<Packet> Tagged(const WireCapture& capture, unsigned seed, unsigned one_in) {
  std::mt19937 random(seed);
  std::vector<Packet> packets = capture.packets;
  for (Packet& packet : packets) {
    if (random() % one_in != 0 || packet.link_type != 1 || packet.bytes.size() < 14) continue;
    constexpr std::uint8_t kTag[] = {0x81, 0x00, 0x60, 0x05};
    packet.bytes.insert(packet.bytes.begin() + 12, std::begin(kTag), std::end(kTag));
    if (packet.original_length != 0) packet.original_length += sizeof kTag;
  }
  return packets;
}

/// Every cycle a dozen times, as in a run that lasts longer: the packets between two polls of all states again and
/// again.
std::vector<Packet> Lasting(const WireCapture& capture) {
  constexpr std::size_t kMost = 4'000;
  constexpr int kTimes = 12;
  std::vector<Packet> packets;
  for (std::size_t i = 0; i < capture.packets.size() && packets.size() < kMost; i += 2) {
    const std::size_t end = std::min(i + 2, capture.packets.size());
    const auto part = test::FindEtherCat(capture.packets[i]);
    const int times = part && part->cyclic ? kTimes : 1;
    for (int n = 0; n < times; ++n) {
      packets.insert(packets.end(), capture.packets.begin() + static_cast<std::ptrdiff_t>(i),
                     capture.packets.begin() + static_cast<std::ptrdiff_t>(end));
    }
  }
  // Later by a microsecond each, so that no stamp comes twice.
  for (std::size_t i = 0; i < packets.size(); ++i) packets[i].time += static_cast<TimeNs>(i) * 1'000;
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
    CheckThat(*capture, "with tags", Tagged(*capture, seed, 40));
    CheckThat(*capture, "lasting longer", Lasting(*capture));
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

/// Offset of the first datagram of this command; 0: there is none.
std::size_t FindCommand(const Packet& packet, wire::Command command) {
  const auto part = test::FindEtherCat(packet);
  for (std::size_t i = 0; part && i < part->count(); ++i) {
    if (packet.bytes[part->datagrams[i]] == static_cast<std::uint8_t>(command)) return part->datagrams[i];
  }
  return 0;
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

TEST(RepeatedCycles, AreNotPublishedInFull) {
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

/// The time of each cycle is another one by up to `most` ns, and so is when it was captured.
/// @param drift  ns that each cycle is later than it should be
std::vector<Packet> Jittering(const WireCapture& capture, unsigned seed, std::int64_t most, std::int64_t drift) {
  std::mt19937 random(seed);
  std::vector<Packet> packets = capture.packets;
  std::int64_t shift = 0;
  std::int64_t late = 0;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    Packet& packet = packets[i];
    if (i % 2 == 0) {
      const auto range = static_cast<std::uint64_t>(2 * most + 1);
      shift = static_cast<std::int64_t>(random() % range) - most;
      late += drift;
    }
    packet.time += shift + late;
    const std::size_t frmw = FindCommand(packet, wire::Command::FRMW);
    if (frmw == 0 || i % 2 == 0) continue;
    std::uint8_t* const at = packet.bytes.data() + frmw + wire::kDatagramHeaderBytes;
    auto time = LoadLittleEndian<std::uint64_t>(at);
    time += static_cast<std::uint64_t>(shift + late);
    for (std::size_t byte = 0; byte < 8; ++byte) at[byte] = static_cast<std::uint8_t>(time >> (8 * byte));
  }
  return packets;
}

/// Which of these a slave was not told of at once.
struct PutOff {
  explicit PutOff(const Observation& of) : observation(of) {}
  const Observation& observation;
  std::uint64_t repeated = 0, put_off = 0;

  void On(const track::FrameRepeated& frame) {
    ++repeated;
    if (observation.sync()->outputs(0).last.frame.number + 10 < frame.sent.number) ++put_off;
  }
};

TEST(RepeatedCycles, MakeNoDifferenceWhereverBetweenTwoPulsesTheyArrive) {
  Story story;
  PlayAtRest(story);
  story.master.Cycles(600);
  const WireCapture capture = test::CaptureOf(story, "arriving");
  struct Way {
    std::int64_t most, drift;
    bool steady;
  };
  unsigned seed = 0;
  for (const Way& way : {Way{0, 0, true}, Way{200, 0, true}, Way{20'000, 0, true}, Way{0, 300, true},
                         Way{0, -700, true}, Way{5'000, 9'000, true}, Way{240'000, 0, false}, Way{600'000, 0, false},
                         Way{0, 100'000, true}, Way{900'000, 40'000, false}}) {
    SCOPED_TRACE(way.most);
    SCOPED_TRACE(way.drift);
    WireCapture jittering = capture;
    jittering.packets = Jittering(capture, ++seed, way.most, way.drift);
    CheckThat(jittering, "jittering", jittering.packets);
    CheckThat(jittering, "jittering with missing packets", Damaged(jittering, seed, 90, true));

    const AnalysisOptions options;
    Observation observation(options, Depth::kClocks);
    PutOff put_off(observation);
    observation.bus().ListenTo<track::FrameRepeated>(Stage::kBeforeModel, put_off);
    observation.SkipRepeatedCycles();
    test::MemorySource source(jittering.packets, jittering.info);
    observation.Run(source, {});
    EXPECT_GT(put_off.repeated, 100U);
    EXPECT_TRUE(!way.steady || put_off.put_off * 2 > put_off.repeated) << put_off.put_off;
  }
}

std::uint64_t SkippedOf(const WireCapture& capture) {
  const AnalysisOptions options;
  Observation observation(options, Depth::kClocks);
  Told told;
  observation.bus().ListenTo<track::CyclesSkipped>(Stage::kBeforeModel, told);
  observation.SkipRepeatedCycles();
  test::MemorySource source(capture.packets, capture.info);
  observation.Run(source, {});
  return told.skipped;
}

/// Terminals without a processor, which echo the acknowledge as error bit, or a single slave, of which each poll shows
/// all.
void PlaySlaves(Story& story, const samples::SlaveDescription& slave, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) story.Add(samples::SlaveDescription(slave));
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = 2 * samples::kMs, .reads_al_status = true});
  story.master.Cycles(120);
}

TEST(RepeatedCycles, MakeNoDifferenceToTerminalsAndSingleSlaves) {
  struct Bus {
    const char* name;
    samples::SlaveDescription slave;
    std::size_t count;
    bool rests;
  };
  unsigned seed = 0;
  for (const Bus& bus :
       {Bus{"terminals", samples::InputTerminal(), 12, true}, Bus{"one terminal", samples::InputTerminal(), 1, false},
        Bus{"one drive", samples::AkdDrive(), 1, true}}) {
    Story story;
    PlaySlaves(story, bus.slave, bus.count);
    const WireCapture capture = test::CaptureOf(story, bus.name);
    EXPECT_EQ(SkippedOf(capture) > 90, bus.rests) << bus.name;
    CheckThat(capture, "as it is", capture.packets);
    for (int again = 0; again < 4; ++again) {
      CheckThat(capture, "with flipped bits", Damaged(capture, ++seed, 60, false));
      CheckThat(capture, "with missing packets", Damaged(capture, ++seed, 60, true));
    }
    const auto polled = [&](std::size_t at, int status, int code) {
      std::vector<Packet> packets = capture.packets;
      const std::size_t brd = FindCommand(packets[at / 2 * 2 + 1], wire::Command::BRD);
      EXPECT_NE(brd, 0U);
      std::vector<std::uint8_t>& bytes = packets[at / 2 * 2 + 1].bytes;
      bytes[brd + 10] = static_cast<std::uint8_t>(status);
      const std::size_t length = bytes[brd + 6];
      if (length >= 6) bytes[brd + 14] = static_cast<std::uint8_t>(code);
      return packets;
    };
    const std::size_t end = capture.packets.size();
    for (const int status : {0x0A, 0x0C, 0x1A, 0x18, 0x04, 0x00}) {
      // From some cycle on, to the end or for some time.
      for (const std::size_t until : {end, end - 40}) {
        WireCapture other = capture;
        for (std::size_t at = end - 160; at < until; ++at) {
          const std::size_t brd = FindCommand(other.packets[at], wire::Command::BRD);
          if (brd != 0 && at % 2 == 1) other.packets[at].bytes[brd + 10] = static_cast<std::uint8_t>(status);
        }
        CheckThat(capture, "with status " + std::to_string(status) + " for long", other.packets);
        if (status == 0x0A && until == end) EXPECT_EQ(SkippedOf(other) > 90, bus.count > 1) << bus.name;
      }
    }
    for (const int status : {0x08, 0x18, 0x28, 0x04, 0x14, 0x1C, 0x0C}) {
      for (const int code : {0x00, 0x1B}) {
        CheckThat(capture, "another status", polled(end - 2, status, code));
        CheckThat(capture, "another status for once", polled(end - 60, status, code));
      }
    }
  }
}

/// Builds a run of cycles and changes one frame near its end; whatever it is, the reports are the same.
void CheckChanged(const std::string& how, const std::function<void(std::vector<Packet>&, std::size_t)>& change) {
  Story story;
  PlayAtRest(story);
  story.master.Cycles(200);
  WireCapture capture = test::CaptureOf(story, "changed");
  for (const std::size_t before_end : {2U, 3U, 40U, 41U}) {
    std::vector<Packet> packets = capture.packets;
    change(packets, packets.size() - before_end);
    CheckThat(capture, how + ", " + std::to_string(before_end) + " before the end", packets);
  }
}

TEST(RepeatedCycles, MakeNoDifferenceWhateverChangesAtTheEnd) {
  CheckChanged("another tag", [](std::vector<Packet>& packets, std::size_t at) {
    constexpr std::uint8_t kTag[] = {0x81, 0x00, 0x60, 0x05};
    packets[at].bytes.insert(packets[at].bytes.begin() + 12, std::begin(kTag), std::end(kTag));
  });
  CheckChanged("no time", [](std::vector<Packet>& packets, std::size_t at) {
    // What was sent comes back as it was.
    const std::size_t pair = at / 2 * 2;
    const std::size_t frmw = FindCommand(packets[pair], wire::Command::FRMW);
    ASSERT_NE(frmw, 0U);
    std::copy_n(packets[pair].bytes.begin() + static_cast<std::ptrdiff_t>(frmw + 10), 8,
                packets[pair + 1].bytes.begin() + static_cast<std::ptrdiff_t>(frmw + 10));
  });
  CheckChanged("another status", [](std::vector<Packet>& packets, std::size_t at) {
    const std::size_t brd = FindCommand(packets[at / 2 * 2 + 1], wire::Command::BRD);
    ASSERT_NE(brd, 0U);
    packets[at / 2 * 2 + 1].bytes[brd + 10] = 0x0C;
  });
  CheckChanged("another counter", [](std::vector<Packet>& packets, std::size_t at) {
    std::vector<std::uint8_t>& bytes = packets[at / 2 * 2 + 1].bytes;
    const std::size_t lrw = FindCommand(packets[at / 2 * 2 + 1], wire::Command::LRW);
    ASSERT_NE(lrw, 0U);
    const std::size_t length = bytes[lrw + 6] | static_cast<std::size_t>(bytes[lrw + 7] & 7U) << 8U;
    bytes[lrw + 10 + length] ^= 1U;
  });
}

/// A state is asked for while a cycle is under way.
TEST(RepeatedCycles, MakeNoDifferenceToARequestThatCrossesThem) {
  Story story;
  PlayAtRest(story);
  story.master.Cycles(100);
  WireCapture capture = test::CaptureOf(story, "crossing");
  Story asked;
  PlayAtRest(asked);
  asked.master.ShutDown();
  const WireCapture down = test::CaptureOf(asked, "down");
  const auto request = std::find_if(down.packets.rbegin(), down.packets.rend(), [](const Packet& packet) {
    return FindCommand(packet, wire::Command::FPWR) != 0 || FindCommand(packet, wire::Command::BWR) != 0;
  });
  ASSERT_NE(request, down.packets.rend());
  for (const std::size_t before_end : {1U, 3U, 21U}) {
    std::vector<Packet> packets = capture.packets;
    Packet crossing = *std::next(request);
    crossing.time = packets[packets.size() - before_end].time;
    packets.insert(packets.end() - static_cast<std::ptrdiff_t>(before_end), crossing);
    CheckThat(capture, "a request " + std::to_string(before_end) + " before the end", packets);
  }
}

TEST(RepeatedCycles, ArePublishedInFullOnRequest) {
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
