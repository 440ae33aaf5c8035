/// Law: slaves that join or leave a line at work, anywhere in it, make no finding about any slave that goes on,
/// whatever the master does first.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/sentences.h"
#include "tests/property/zoo.h"

namespace ecaudit {
namespace {

using samples::Al;
using samples::Story;

constexpr TimeNs kCycle = 2 * samples::kMs;
constexpr std::uint16_t kStationAddress = 0x0010;
constexpr std::uint16_t kAlControl = 0x0120;
constexpr std::uint16_t kAlStatus = 0x0130;
constexpr std::uint16_t kLocalTime = 0x0918;
constexpr std::uint16_t kTimeOffset = 0x0920;

/// What the master does when it sees another number of slaves.
struct Habit {
  std::string name;
  bool polls_others = false;        ///< AL Status of each slave, by its station address
  bool begins_by_position = false;  ///< INIT and AL Status of the new slave, before it has an address
  bool reads_addresses = false;     ///< of all, by position, first
};

const std::vector<Habit> kHabits{{"at once"},
                                 {"polls", true, false, false},
                                 {"by position", false, true, false},
                                 {"looks first", false, true, true},
                                 {"polls, by position", true, true, false}};

void PlayToOp(Story& story, std::size_t slaves) {
  for (std::size_t i = 0; i < slaves; ++i) story.Add(samples::AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.SetUpClocks(8);
  story.master.BringToSafeop();
  for (std::size_t i = 0; i < slaves; ++i) story.master.StartSync0(i, static_cast<std::uint32_t>(kCycle));
  story.master.WaitUntil((story.master.now() / kCycle + 1) * kCycle + kCycle / 2);
  story.master.BringToOp({.cycle = kCycle, .distributes_time = true, .reads_al_status = true});
  story.master.Cycles(20);
}

void Look(Story& story, const Habit& habit, std::size_t position) {
  samples::ScriptedMaster& master = story.master;
  for (std::size_t i = 0; habit.polls_others && i < story.bus.size(); ++i) {
    if (i != position) master.Fprd(master.station(i), kAlStatus, 6);
  }
  for (std::size_t i = 0; habit.reads_addresses && i < story.bus.size(); ++i) master.Aprd(i, kStationAddress, 2);
  if (!habit.begins_by_position) return;
  master.Aprd(position, 0x0000, 10);
  master.Apwr(position, kAlControl, {0x11, 0});
  master.Aprd(position, kAlStatus, 6);
}

/// By its station address, to OP; its process data are where they were where it had some.
void StartUp(Story& story, std::size_t position, bool is_new) {
  samples::ScriptedMaster& master = story.master;
  const std::uint16_t station = master.station(position);
  master.Apwr(position, kStationAddress, samples::LeBytes(station));
  master.Poll(position, 1);
  master.SetUpMailbox(position);
  master.ChangeState(position, Al::kPreop);
  const samples::Bytes time = master.Fprd(master.station(position == 0 ? 1 : 0), 0x0910, 8).data;
  const samples::Bytes local = master.Fprd(station, kLocalTime, 8).data;
  const auto offset = samples::LoadLe<std::uint64_t>(time, 0) - samples::LoadLe<std::uint64_t>(local, 0);
  master.Fpwr(station, kTimeOffset, samples::LeBytes(offset));
  master.SetUpProcessData(position);
  if (is_new) {
    master.MapBehind(position);
  } else {
    master.MapAgain(position);
  }
  master.ChangeState(position, Al::kSafeop);
  master.StartSync0(position, static_cast<std::uint32_t>(kCycle));
  master.Cycles(20);
  master.ChangeState(position, Al::kOp);
}

/// Errors and warnings that no slave's joining and leaving makes.
std::string Others(const Story& story, std::size_t slaves, bool left) {
  test::WireCapture capture = test::CaptureOf(story, "hot-connect");
  test::MemorySource source(std::move(capture.packets), capture.info);
  const AnalysisResult result = Analyse(source, {});
  std::string text;
  for (const Finding& f : result.findings) {
    // The others take the time of the master for that of the first one while it is away.
    const bool of_clock = f.rule == "sync-drift-uncompensated" && f.caused_by != kNoFinding;
    const bool own = left && (f.rule == "bus-slave-count-changed" || f.rule == "wkc-mismatch" || of_clock);
    if (f.severity == Severity::kInfo || own) continue;
    text += "\n  " + std::string(f.rule) + " slave " + std::to_string(f.slave) + " in frame " +
            std::to_string(f.first.number) + ": " + report::TitleOf(f);
  }
  if (result.slaves.size() != slaves) text += "\n  slaves: " + std::to_string(result.slaves.size());
  for (const SlaveSummary& slave : result.slaves) {
    // Of some nobody can know where they are.
    const auto expected = story.master.station(slave.position);
    if (!slave.position_inferred && slave.station_address.value_or(0) != expected) {
      text +=
          "\n  position " + std::to_string(slave.position) + ": " + std::to_string(slave.station_address.value_or(0));
    }
  }
  return text;
}

/// Masters that use station addresses, and one LRW for all slaves.
std::vector<samples::NamedWay> Ways() {
  std::vector<samples::NamedWay> out;
  for (const samples::NamedWay& one : samples::MasterWays()) {
    const samples::Grouping& grouping = one.way.grouping;
    if (one.way.addressing != samples::Addressing::kStation || grouping.apart_by_slave || grouping.apart_by_direction) {
      continue;
    }
    out.push_back(one);
  }
  return out;
}

void Join(Story& story, const Habit& habit, std::size_t at, std::size_t group, std::uint16_t first_station) {
  for (std::size_t i = 0; i < group; ++i) {
    story.bus.Insert(at + i, samples::AkdDrive(), story.master.now());
    story.master.Joined(at + i, static_cast<std::uint16_t>(first_station + i));
  }
  story.master.Cycles(5);
  for (std::size_t i = 0; i < group; ++i) {
    Look(story, habit, at + i);
    StartUp(story, at + i, true);
  }
  story.master.Cycles(50);
}

void LeaveAndComeBack(Story& story, const Habit& habit, std::size_t at) {
  const std::size_t slaves = story.bus.size();
  story.bus.Remove(at);
  story.master.Cycles(300);
  for (std::size_t i = 0; habit.polls_others && i < slaves; ++i) {
    story.master.Fprd(story.master.station(i), kAlStatus, 6);
  }
  if (habit.begins_by_position) story.master.Aprd(1, kAlStatus, 6);
  story.master.Cycles(50);
  story.bus.Insert(at, samples::AkdDrive(), story.master.now());
  story.master.Cycles(5);
  Look(story, habit, at);
  StartUp(story, at, false);
  story.master.Cycles(100);
}

TEST(HotConnectLaw, AGroupJoins) {
  for (const samples::NamedWay& way : Ways()) {
    for (const Habit& habit : kHabits) {
      for (std::size_t at = 1; at <= 3; ++at) {
        for (std::size_t group = 1; group <= 2; ++group) {
          SCOPED_TRACE(std::string(way.name) + ", " + habit.name + ", " + std::to_string(group) + " at " +
                       std::to_string(at));
          Story story(way.way);
          PlayToOp(story, 3);
          Join(story, habit, at, group, 0x2001);
          for (std::size_t i = 0; i < 3 + group; ++i) story.master.Fprd(story.master.station(i), kAlStatus, 6);
          story.master.Cycles(50);
          EXPECT_EQ(Others(story, 3 + group, false), "");
        }
      }
    }
  }
}

TEST(HotConnectLaw, OneLeavesAndComesBackWithoutPower) {
  for (const samples::NamedWay& way : Ways()) {
    for (const Habit& habit : kHabits) {
      for (std::size_t at = 0; at <= 2; ++at) {
        SCOPED_TRACE(std::string(way.name) + ", " + habit.name + " at " + std::to_string(at));
        Story story(way.way);
        PlayToOp(story, 3);
        LeaveAndComeBack(story, habit, at);
        EXPECT_EQ(Others(story, 3, true), "");
      }
    }
  }
}

TEST(HotConnectLaw, SomeJoinAndSomeLeave) {
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    samples::Jitter random(seed);
    const auto below = [&](std::size_t limit) {
      return static_cast<std::size_t>(random.Next(static_cast<TimeNs>(limit)));
    };
    Story story;
    PlayToOp(story, 3);
    bool left = false;
    std::uint16_t next_station = 0x2001;
    for (int step = 0; step < 3; ++step) {
      const Habit& habit = kHabits[below(kHabits.size())];
      if (below(2) == 0) {
        LeaveAndComeBack(story, habit, below(story.bus.size()));
        left = true;
      } else {
        Join(story, habit, 1 + below(story.bus.size()), 1 + below(2), next_station);
        next_station = static_cast<std::uint16_t>(next_station + 2);
      }
    }
    EXPECT_EQ(Others(story, story.bus.size(), left), "");
  }
}

}  // namespace
}  // namespace ecaudit
