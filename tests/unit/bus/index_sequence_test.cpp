#include "decoder/bus/index_sequence.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/trace_builder.h"

namespace ecaudit::bus::test {
namespace {

using ecaudit::test::MemorySource;
using ecaudit::test::Packet;
using ecaudit::test::Trace;
using samples::Bytes;

/// What is sent: a poll of a slave, a process-data frame, a broadcast that sets the bus up.
enum class Sort : std::uint8_t { kPoll, kProcess, kOtherSlave, kSetUp };
struct Sent {
  Sort sort = Sort::kPoll;
  std::uint8_t index = 0;
};

/// One character a frame, as `look` has it of the sequence and of the step that the frame is.
template <class Look>
std::string FollowAll(const Trace& trace, const Look& look) {
  const std::vector<Packet> packets = trace.Packets();
  MemorySource source(packets);
  IndexSequence sequence;
  capture::CapturedFrame packet;
  std::string out;
  while (source.Next(packet) == capture::ReadStatus::kFrame) {
    const IndexSequence::Step step = sequence.Follow(wire::FrameView::Parse(packet), false);
    out += look(sequence, step);
  }
  return out;
}

template <class Look>
std::string Each(const std::vector<Sent>& frames, const Look& look) {
  Trace trace;
  for (const Sent& sent : frames) {
    auto& frame = trace.After(1000);
    switch (sent.sort) {
      case Sort::kPoll:
        frame.Fprd(0x1001, 0x0130, {8, 0});
        break;
      case Sort::kOtherSlave:
        frame.Fprd(0x1002, 0x0130, {8, 0});
        break;
      case Sort::kProcess:
        frame.Lrw(0x1000, Bytes(8, 0), Bytes(8, 1));
        break;
      case Sort::kSetUp:
        frame.Bwr(0x0101, {0});
        break;
    }
    frame.Index(sent.index).Lost();
  }
  return FollowAll(trace, look);
}

/// '.' unknown, 'n' next, 'B' broken; a few numbers further are unknown.
std::string Follow(const std::vector<Sent>& frames) {
  return Each(frames, [](const IndexSequence&, IndexSequence::Step step) {
    return step == IndexSequence::Step::kNext ? 'n' : step == IndexSequence::Step::kBroken ? 'B' : '.';
  });
}

/// The last frame is a few numbers further.
bool EndsFewFurther(const std::vector<Sent>& frames) {
  return Each(frames, [](const IndexSequence&, IndexSequence::Step step) {
           return step == IndexSequence::Step::kFew ? 'f' : '.';
         }).back() == 'f';
}

/// 'l' loose, 'c' continued, '.' neither.
std::string Looks(const std::vector<Sent>& frames) {
  return Each(frames, [](const IndexSequence& sequence, IndexSequence::Step) {
    return sequence.loose() ? 'l' : sequence.continued() ? 'c' : '.';
  });
}

/// Polls numbered by `index_of`, frame `left_out` and the two behind it missing.
std::string WithHole(std::size_t count, std::size_t left_out, const std::function<unsigned(std::size_t)>& index_of) {
  std::vector<Sent> frames;
  for (std::size_t i = 0; i < count; ++i) {
    if (i >= left_out && i < left_out + 3) continue;
    frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(index_of(i))});
  }
  return Follow(frames);
}

std::size_t Broken(const std::string& steps) {
  return static_cast<std::size_t>(std::count(steps.begin(), steps.end(), 'B'));
}

struct Way {
  const char* name;
  std::function<unsigned(std::size_t)> index_of;
};

/// As masters number, and as none does.
const std::vector<Way>& Ways() {
  static const std::vector<Way> kWays{
      {"16 indices", [](std::size_t i) { return i % 16; }},
      {"100 indices", [](std::size_t i) { return i % 100; }},
      {"256 indices", [](std::size_t i) { return i % 256; }},
      {"128 to 239", [](std::size_t i) { return 128 + i % 112; }},
      {"7 to 20", [](std::size_t i) { return 7 + i % 14; }},
      {"every seventh", [](std::size_t i) { return i * 7 % 256; }},
      {"every second of 128", [](std::size_t i) { return i * 2 % 128; }},
  };
  return kWays;
}

TEST(IndexSequence, AnyRegularWayOfNumberingShowsAGap) {
  for (const Way& way : Ways()) {
    const std::string steps = WithHole(600, 405, way.index_of);
    EXPECT_EQ(Broken(steps), 1U) << way.name << ": " << steps;
    EXPECT_EQ(steps[405], 'B') << way.name << ": " << steps;
  }
}

TEST(IndexSequence, NoWayOfNumberingHasGapsByItself) {
  for (const Way& way : Ways()) {
    const std::string steps = WithHole(2000, 2000, way.index_of);
    EXPECT_EQ(Broken(steps), 0U) << way.name << ": " << steps;
    EXPECT_EQ(steps.substr(1000).find('.'), std::string::npos) << way.name;
  }
}

/// Every datagram has a number of its own: the counter begins anew behind a frame or within one.
struct Numbers {
  std::uint8_t first = 0, last = 0;
};

std::vector<Numbers> EachDatagram(unsigned begin, unsigned modulus, const std::vector<unsigned>& datagrams,
                                  std::size_t frames) {
  std::vector<Numbers> out;
  unsigned at = 0;
  for (std::size_t i = 0; i < frames; ++i) {
    const unsigned count = datagrams[i % datagrams.size()];
    out.push_back({static_cast<std::uint8_t>(begin + at % modulus),
                   static_cast<std::uint8_t>(begin + (at + count - 1) % modulus)});
    at += count;
  }
  return out;
}

/// The frames at which a regular counter shows a hole, those from `left_out` on missing.
std::vector<std::size_t> CaptureGaps(const std::vector<Numbers>& frames, std::size_t left_out, std::size_t missing) {
  IndexCounter counter;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (i >= left_out && i < left_out + missing) continue;
    const bool regular = counter.IsRegular();
    const IndexCounter::Step step = counter.Follow(frames[i].first, frames[i].last);
    if (regular && (step == IndexCounter::Step::kOdd || step == IndexCounter::Step::kBegins)) out.push_back(i);
  }
  return out;
}

TEST(IndexCounter, NumberingEachDatagramHasNoGapsAndShowsThem) {
  const std::vector<std::vector<unsigned>> kDatagrams{{1},    {2},       {3},          {4},       {5},
                                                      {7},    {8},       {15},         {16},      {17},
                                                      {1, 2}, {3, 3, 2}, {1, 1, 1, 4}, {2, 5, 1}, {1, 1, 1, 1, 1, 2}};
  constexpr std::size_t kFrames = 4000;
  for (const unsigned modulus :
       {3U, 4U, 5U, 7U, 8U, 15U, 16U, 17U, 31U, 33U, 64U, 100U, 111U, 112U, 200U, 255U, 256U}) {
    for (const unsigned begin : {0U, 1U, 7U, 128U}) {
      if (begin + modulus > 256) continue;
      for (std::size_t d = 0; d < kDatagrams.size(); ++d) {
        const std::string what = std::to_string(modulus) + " from " + std::to_string(begin) + ", datagrams " +
                                 std::to_string(d) + ", hole behind ";
        const std::vector<Numbers> frames = EachDatagram(begin, modulus, kDatagrams[d], kFrames);
        EXPECT_EQ(CaptureGaps(frames, kFrames, 0).size(), 0U) << what << "none";
        for (const std::size_t at : {2501U, 2507U, 2533U}) {
          for (const std::size_t missing : {1U, 2U, 5U}) {
            const Numbers before = frames[at - 1];
            const std::uint8_t next = frames[at + missing].first;
            // What looks like the next one of a frame, or of its first datagram, or like a repetition.
            const bool looks_right = next == frames[at].first || next == static_cast<std::uint8_t>(before.last + 1U) ||
                                     next == static_cast<std::uint8_t>(before.first + 1U) || next == before.first;
            if (looks_right) continue;
            EXPECT_EQ(CaptureGaps(frames, at, missing), std::vector<std::size_t>{at + missing}) << what << at;
          }
        }
      }
    }
  }
}

/// As TwinCAT numbers: the first datagram of acyclic frames from 80h to FFh, of cyclic frames the outputs, and no other
/// one.  @param left_out  cyclic frame that the capture misses, with the one after it
std::string AsTwinCat(std::size_t left_out) {
  Trace trace;
  unsigned acyclic_frames = 1;
  for (std::size_t i = 0; i < 2000; ++i) {
    // A start-up, then polls now and then.
    for (int polls = i == 0 ? 40 : i % 7 == 3 ? 1 : 0; polls > 0; --polls) {
      const auto index = static_cast<std::uint8_t>(0x80 + acyclic_frames++ % 0x80);
      trace.After(10).Fprd(0x1001, 0x0300, {0}).Index(index).Fprd(0x1002, 0x0300, {0}).Index(0).Lost();
    }
    if (i == left_out || i == left_out + 1) continue;
    auto& frame = trace.After(1000);
    frame.Lrd(0x9000000, {1}).Index(0);
    frame.Lrw(0x1000000, Bytes(8, 0), Bytes(8, 1)).Index(static_cast<std::uint8_t>(i));
    frame.Brd(0x0130, {8, 0}).Index(0).Lost();
  }
  return FollowAll(trace, [](const IndexSequence&, IndexSequence::Step step) {
    return step == IndexSequence::Step::kNext ? 'n' : step == IndexSequence::Step::kBroken ? 'B' : '.';
  });
}

TEST(IndexSequence, NumbersMayStandInTheOutputsOnly) {
  const std::string whole = AsTwinCat(5000);
  EXPECT_EQ(Broken(whole), 0U) << whole;
  // Both counters have restarted.
  const std::string later = whole.substr(1100);
  EXPECT_EQ(std::count(later.begin(), later.end(), 'n'), static_cast<std::ptrdiff_t>(later.size())) << later;
  EXPECT_EQ(Broken(AsTwinCat(1500)), 1U);
}

TEST(IndexSequence, WhatIsNoOrderShowsNothing) {
  const std::vector<Way> ways{
      {"one index", [](std::size_t) { return 0xFFU; }},
      {"another one", [](std::size_t) { return 0x41U; }},
      {"none", [](std::size_t) { return 0U; }},
      {"at random", [](std::size_t i) { return static_cast<unsigned>(i * 2654435761U >> 11U) % 256; }},
  };
  for (const Way& way : ways) EXPECT_EQ(Broken(WithHole(2000, 700, way.index_of)), 0U) << way.name;
}

TEST(IndexSequence, WhoBeginsAgainAnywhereHasNoGaps) {
  const auto index_of = [](std::size_t i) { return static_cast<unsigned>(i % 23 % (11 + i / 23 % 5)); };
  EXPECT_EQ(Broken(WithHole(2000, 2000, index_of)), 0U);
}

TEST(IndexSequence, BackToWhereNoCounterBeginsIsAGap) {
  // The end of the counter is not seen before.
  std::vector<Sent> frames;
  for (unsigned i = 0; i < 98; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(0x80 + i)});
  for (unsigned i = 10; i < 60; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(0x80 + i)});
  const std::string steps = Follow(frames);
  EXPECT_EQ(steps[98], 'B') << steps;
  EXPECT_EQ(Broken(steps), 1U) << steps;
}

/// Cyclic frames with a counter of their own and every `distance`-th time an acyclic one.
std::vector<Sent> SideBySide(std::size_t cycles, std::size_t distance, unsigned first_acyclic, unsigned round) {
  std::vector<Sent> frames;
  unsigned acyclic = 0;
  for (std::size_t i = 0; i < cycles; ++i) {
    frames.push_back({Sort::kProcess, static_cast<std::uint8_t>(i % round)});
    if (i % distance == distance - 1) {
      frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(first_acyclic + acyclic++ % round)});
    }
  }
  return frames;
}

TEST(IndexSequence, TwoCountersSideBySideHaveNoGaps) {
  for (const std::size_t distance : {1U, 2U, 3U, 7U, 20U, 50U, 300U}) {
    EXPECT_EQ(Broken(Follow(SideBySide(2000, distance, 0x80, 0x80))), 0U) << distance;
    EXPECT_EQ(Broken(Follow(SideBySide(2000, distance, 0, 256))), 0U) << distance;
  }
}

TEST(IndexSequence, AGapShowsInEitherOfTwoCounters) {
  for (const std::size_t distance : {1U, 2U, 20U}) {
    std::vector<Sent> frames = SideBySide(1000, distance, 0x80, 0x80);
    const auto at = frames.begin() + 700;
    frames.erase(at, at + 10);
    const std::string steps = Follow(frames);
    EXPECT_EQ(Broken(steps), 1U) << distance << steps;
  }
}

TEST(IndexSequence, ACounterForEachSlave) {
  std::vector<Sent> frames;
  for (std::size_t i = 0; i < 400; ++i) {
    const bool second = i % 5 == 1 || i % 5 == 3;
    frames.push_back({second ? Sort::kOtherSlave : Sort::kPoll,
                      static_cast<std::uint8_t>(second ? 0x40 + i * 2 / 5 % 64 : i * 3 / 5 % 64)});
  }
  EXPECT_EQ(Broken(Follow(frames)), 0U);
}

TEST(IndexSequence, SlavesInTurnUnderOneCounterHaveNoneOfTheirOwn) {
  for (const std::size_t missing : {1U, 3U}) {
    std::vector<Sent> frames;
    for (std::size_t i = 0; i < 200; ++i) {
      if (i >= 101 && i < 101 + missing) continue;
      frames.push_back({i % 2 != 0 ? Sort::kOtherSlave : Sort::kPoll, static_cast<std::uint8_t>(i)});
    }
    EXPECT_EQ(Broken(Follow(frames)), 1U) << missing;
  }
}

TEST(IndexSequence, TheFirstFramesOfAnotherKindAreNoGap) {
  std::vector<Sent> frames;
  for (unsigned i = 0; i < 200; ++i) frames.push_back({Sort::kProcess, static_cast<std::uint8_t>(i % 64)});
  for (unsigned i = 0; i < 20; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(0x90 + i)});
  for (unsigned i = 200; i < 400; ++i) frames.push_back({Sort::kProcess, static_cast<std::uint8_t>(i % 64)});
  EXPECT_EQ(Broken(Follow(frames)), 0U);
}

/// 'B' broken, 'E' broken earlier, '.' neither; a small letter: the counter has left out numbers before.
std::string Breaks(const std::vector<Sent>& frames) {
  return Each(frames, [](const IndexSequence& sequence, IndexSequence::Step step) {
    if (step != IndexSequence::Step::kBroken) return '.';
    if (sequence.broke_earlier()) return 'E';
    return sequence.left_out_none() ? 'B' : 'b';
  });
}

TEST(IndexSequence, TheFirstGapIsThatOfACounterThatLeftOutNone) {
  std::vector<Sent> frames;
  for (unsigned i = 0; i < 120; ++i) {
    if (i % 40 < 36) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(i)});
  }
  EXPECT_EQ(Breaks(frames), std::string(36, '.') + "B" + std::string(35, '.') + "B" + std::string(35, '.'));
  frames.erase(frames.begin() + 50);
  EXPECT_EQ(Breaks(frames), std::string(36, '.') + "B" + std::string(13, '.') + "b" + std::string(20, '.') + "b" +
                                std::string(35, '.'));
}

TEST(IndexSequence, AGapBeforeTheFirstFramesOfAnotherKindShowsLater) {
  const auto then = [](std::uint8_t process, std::uint8_t poll) {
    std::vector<Sent> frames;
    for (std::uint8_t i = 0; i < 40; ++i) frames.push_back({Sort::kPoll, i});
    for (std::uint8_t i = 0; i < 5; ++i) frames.push_back({Sort::kProcess, static_cast<std::uint8_t>(process + i)});
    for (std::uint8_t i = 0; i < 5; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(poll + i)});
    return Breaks(frames).substr(40);
  };
  EXPECT_EQ(then(0x60, 0x65), ".....E....");
  EXPECT_EQ(then(40, 45), "..........");
  // They have a counter of their own.
  EXPECT_EQ(then(0x60, 40), "..........");
}

TEST(IndexSequence, AFewNumbersFurtherMayBeAGap) {
  const auto after = [](std::uint8_t polls, Sent last) {
    std::vector<Sent> frames;
    for (std::uint8_t i = 0; i < polls; ++i) frames.push_back({Sort::kPoll, i});
    frames.push_back(last);
    return frames;
  };
  // Another sort of frame may have a counter of its own, but not one that is so close to this.
  EXPECT_TRUE(EndsFewFurther(after(12, {Sort::kProcess, 13})));
  EXPECT_TRUE(EndsFewFurther(after(12, {Sort::kProcess, 20})));
  EXPECT_FALSE(EndsFewFurther(after(12, {Sort::kProcess, 21})));
  EXPECT_FALSE(EndsFewFurther(after(12, {Sort::kProcess, 12})));
  EXPECT_FALSE(EndsFewFurther(after(12, {Sort::kProcess, 1})));
  // A counter that is young.
  EXPECT_TRUE(EndsFewFurther(after(4, {Sort::kPoll, 5})));
  EXPECT_FALSE(EndsFewFurther(after(3, {Sort::kPoll, 4})));
}

TEST(IndexSequence, FramesThatAreNotNumberedBetweenOthers) {
  for (const std::uint8_t none : {std::uint8_t{0}, std::uint8_t{255}}) {
    std::vector<Sent> frames;
    for (unsigned i = 0; i < 1000; ++i) {
      frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(128 + i % 112)});
      if (i % 9 == 4) frames.push_back({Sort::kPoll, none});
      if (i % 200 == 60) frames.insert(frames.end(), 12, {Sort::kPoll, none});
    }
    EXPECT_EQ(Broken(Follow(frames)), 0U) << int{none};
  }
}

TEST(IndexSequence, WhoSetsUpTheBusBeginsAgain) {
  // TwinCAT from 128 on at each initialisation, wherever it was.
  std::vector<Sent> frames;
  for (const unsigned length : {300U, 30U, 250U, 17U, 60U, 400U, 90U}) {
    frames.push_back({Sort::kSetUp, 128});
    for (unsigned i = 1; i < length; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(128 + i % 112)});
  }
  EXPECT_EQ(Broken(Follow(frames)), 0U);
}

TEST(IndexSequence, BackFromAnywhereElseIsAGapOnceTheEndIsKnown) {
  std::vector<Sent> frames;
  for (unsigned i = 0; i < 110; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(i % 16)});
  for (unsigned i = 120; i < 200; ++i) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(i % 16)});
  const std::string steps = Follow(frames);
  EXPECT_EQ(steps[110], 'B') << steps;
  EXPECT_EQ(Broken(steps), 1U) << steps;
}

TEST(IndexSequence, OnlyAnIndexThatNothingExplainsIsLoose) {
  EXPECT_EQ(Looks({{Sort::kPoll, 3}, {Sort::kPoll, 4}, {Sort::kPoll, 5}}), ".cc");
  EXPECT_EQ(Looks({{Sort::kPoll, 0}, {Sort::kPoll, 0}, {Sort::kProcess, 0}}), "...") << "one for all";
  EXPECT_EQ(Looks({{Sort::kPoll, 3}, {Sort::kPoll, 9}, {Sort::kPoll, 40}}), ".ll") << "a filter left some out";
  // Cyclic and acyclic frames side by side, each with a counter or an index of its own.
  EXPECT_EQ(Looks({{Sort::kProcess, 0}, {Sort::kPoll, 128}, {Sort::kProcess, 0}, {Sort::kPoll, 129}}), ".l.c");
}

TEST(IndexSequence, AfterAFrameThatCannotBeReadNothingIsBroken) {
  IndexSequence sequence;
  Trace trace;
  for (unsigned i = 0; i < 40; ++i)
    trace.After(1000).Fprd(0x1001, 0x0130, {8, 0}).Index(static_cast<std::uint8_t>(i)).Lost();
  trace.After(1000).Fprd(0x1001, 0x0130, {8, 0}).Index(44).Lost();
  const std::vector<Packet> packets = trace.Packets();
  MemorySource source(packets);
  capture::CapturedFrame packet;
  for (unsigned i = 0; i < 40; ++i) {
    ASSERT_EQ(source.Next(packet), capture::ReadStatus::kFrame);
    (void)sequence.Follow(wire::FrameView::Parse(packet), false);
  }
  sequence.Skip();
  ASSERT_EQ(source.Next(packet), capture::ReadStatus::kFrame);
  EXPECT_EQ(sequence.Follow(wire::FrameView::Parse(packet), false), IndexSequence::Step::kUnknown);
}

/// A poll numbered by each of the numbers, one after the other.
std::vector<Sent> PollsOf(const std::vector<unsigned>& numbers) {
  std::vector<Sent> frames;
  for (const unsigned n : numbers) frames.push_back({Sort::kPoll, static_cast<std::uint8_t>(n)});
  return frames;
}

TEST(IndexSequence, GoesOnWhereItWasLeftByAnotherProgram) {
  std::vector<unsigned> numbers;
  for (unsigned i = 0; i < 40; ++i) numbers.push_back(i);
  numbers.push_back(150);  // the other program
  for (unsigned i = 40; i < 50; ++i) numbers.push_back(i);
  numbers.push_back(151);
  for (unsigned i = 50; i < 60; ++i) numbers.push_back(i);
  const std::string steps = Follow(PollsOf(numbers));
  EXPECT_EQ(std::count(steps.begin(), steps.end(), 'B'), 1) << steps;
  EXPECT_EQ(steps[40], 'B');
  EXPECT_EQ(steps[41], 'n');
  EXPECT_EQ(steps[51], 'n');
  EXPECT_EQ(steps[52], 'n');
}

TEST(IndexSequence, AGapThatEndsWhereAnotherOneBeganLongBeforeIsAGap) {
  std::vector<unsigned> numbers;
  for (unsigned i = 0; i < 40; ++i) numbers.push_back(i);
  for (unsigned i = 150; i < 276; ++i) numbers.push_back(i % 256);
  for (unsigned i = 40; i < 80; ++i) numbers.push_back(i);
  const std::string steps = Follow(PollsOf(numbers));
  EXPECT_EQ(steps[40], 'B');
  EXPECT_EQ(steps[166], 'B');
}

TEST(IndexSequence, TwoProgramsThatAreKnownToTakeTurnsDoSoHoweverLongOneWaits) {
  std::vector<unsigned> numbers;
  unsigned first = 0, other = 150;
  const auto turn = [&](unsigned of_first) {
    for (unsigned i = 0; i < of_first; ++i) numbers.push_back(first++);
    numbers.push_back(other++);
  };
  turn(40);
  turn(10);
  turn(10);
  turn(40);
  turn(40);
  const std::string steps = Follow(PollsOf(numbers));
  EXPECT_EQ(std::count(steps.begin(), steps.end(), 'B'), 1) << steps;
}

TEST(IndexSequence, SaysHowManyFramesAreMissingAtLeast) {
  std::vector<unsigned> numbers;
  for (unsigned i = 0; i < 40; ++i) numbers.push_back(i);
  numbers.push_back(60);
  std::uint32_t skipped = 0;
  Each(PollsOf(numbers), [&](const IndexSequence& sequence, IndexSequence::Step step) {
    if (step == IndexSequence::Step::kBroken) skipped = sequence.skipped();
    return '.';
  });
  EXPECT_EQ(skipped, 20U);
}

}  // namespace
}  // namespace ecaudit::bus::test
