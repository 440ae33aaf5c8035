// Counts over the frames of one sender, each by what a slave does to a frame (ETG1000.4): position counters of
// broadcasts move by one a slave, working counters by one for a read or a write, and bit 1 of the source address is
// set.
#include "decoder/bus/sender_tally.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/support/trace_builder.h"

namespace ecaudit::bus::test {
namespace {

template <class Each>
void ForEachFrame(const char* text, Each each) {
  const auto trace = ecaudit::test::Trace::Parse(text);
  ASSERT_TRUE(trace.has_value()) << trace.error().message;
  ecaudit::test::MemorySource source(trace->Packets());
  capture::CapturedFrame frame;
  while (source.Next(frame) == capture::ReadStatus::kFrame) each(wire::FrameView::Parse(frame));
}

TEST(SenderTally, SignsAreWhatEachFrameShowsByItself) {
  struct Row {
    const char* trace;
    std::uint32_t bit_clear, bit_set, counted, exchanged;
  };
  for (const Row& row : {
           Row{"+0us LRW 0x10000 00 00 wkc=3", 1, 1, 1, 1},
           Row{"+0us LRW 0x10000 00 00 wkc=0", 1, 1, 0, 0},
           Row{"+0us FPRD 0x1001:0x0130 01 00", 1, 1, 1, 0},
           Row{"@out-only\n+0us FPRD 0x1001:0x0130 01 00 swkc=1", 1, 0, 1, 0},
           Row{"@returned-only\n+0us FPRD 0x1001:0x0130 01 00 wkc=0", 0, 1, 0, 0},
       }) {
    SCOPED_TRACE(row.trace);
    FrameSigns signs;
    ForEachFrame(row.trace, [&](const wire::FrameView& frame) { signs.Add(frame); });
    EXPECT_EQ(signs.bit_clear, row.bit_clear);
    EXPECT_EQ(signs.bit_set, row.bit_set);
    EXPECT_EQ(signs.counted, row.counted);
    EXPECT_EQ(signs.exchanged, row.exchanged);
  }
}

TEST(SenderTally, BothCopiesAreFoundByWhatSlavesChange) {
  struct Row {
    const char* trace;
    std::uint32_t pairs, counted, passed_no_slave;
    std::optional<std::uint16_t> slaves;
    bool ports;
  };
  for (const Row& row : {
           Row{"@slaves 3\n+0us BRD 0x0130 01 00", 1, 0, 0, 3, false},
           Row{"+0us FPRD 0x1001:0x0130 01 00", 1, 0, 0, {}, false},
           Row{"+0us FPRD 0x1001:0x0130 01 00 wkc=0", 0, 0, 0, {}, false},  // comes back as sent
           Row{"@out-only\n+0us FPRD 1:0 00 idx=7\n+1ms FPRD 1:0 00 idx=8 swkc=1", 0, 0, 0, {}, false},  // two frames
           Row{"+0us FPRD 0x1001:0x0130 01 00 swkc=1 wkc=2", 1, 1, 0, {}, false},  // a slave was before
           Row{"@two-interfaces\n+0us FPRD 0x1001:0x0130 01 00", 1, 0, 0, {}, true},
           Row{"+0us BRD 0x0130 00 00 radp=0 wkc=0", 0, 0, 1, {}, false},
       }) {
    SCOPED_TRACE(row.trace);
    CopyPairs pairs;
    ForEachFrame(row.trace, [&](const wire::FrameView& frame) { pairs.Add(frame); });
    EXPECT_EQ(pairs.pairs, row.pairs);
    EXPECT_EQ(pairs.counted, row.counted);
    EXPECT_EQ(pairs.passed_no_slave, row.passed_no_slave);
    EXPECT_EQ(pairs.slaves, row.slaves);
    EXPECT_EQ(pairs.RunFromPortToPort(), row.ports);
  }
}

TEST(SenderTally, ReturnsMayBeStampedBeforeTheyWereSent) {
  struct Row {
    const char *interfaces, *sent;
    std::uint32_t back_first;
  };
  for (const Row& row : {
           Row{"@two-interfaces", "+100us FPRD 1:0 00 idx=7", 1},
           Row{"", "+100us FPRD 1:0 00 idx=7", 0},               // one clock: it is sent again
           Row{"@two-interfaces", "+5ms FPRD 1:0 00 idx=7", 0},  // the next frame with that index
           Row{"@two-interfaces", "+100us FPRD 1:0 00 idx=8", 0},
           Row{"@two-interfaces", "+100us FPRD 1:0 00 idx=7 swkc=1", 0},  // it has come as far as the return
       }) {
    const std::string trace =
        std::string(row.interfaces) + "\n@returned-only\n+0us FPRD 1:0 00 idx=7\n@out-only\n" + row.sent;
    SCOPED_TRACE(trace);
    CopyPairs pairs;
    ForEachFrame(trace.c_str(), [&](const wire::FrameView& frame) { pairs.Add(frame); });
    EXPECT_EQ(pairs.back_first, row.back_first);
    EXPECT_EQ(pairs.pairs, 0U);
  }
}

TEST(SenderTally, RepeatedIsWhatComesAgainAfterAPause) {
  struct Row {
    const char* trace;
    std::uint32_t repeated, index_changes;
  };
  for (const Row& row : {
           Row{"+0us FPRD 0x1001:0x0130 00 00 idx=7\n+5ms FPRD 0x1001:0x0130 00 00 idx=7", 1, 0},
           Row{"+0us FPRD 0x1001:0x0130 00 00 idx=7\n+50us FPRD 0x1001:0x0130 00 00 idx=7", 0, 0},  // captured twice
           Row{"+0us FPRD 0x1001:0x0130 00 00 idx=7\n+5ms FPRD 0x1001:0x0130 00 00 idx=8", 0, 1},
           Row{"+0us FPRD 0x1001:0x0130 00 00 idx=7\n+5ms FPRD 0x1002:0x0130 00 00 idx=7", 0, 0},
           Row{"+0us LRW 0x10000 00 00 idx=7\n+5ms LRW 0x10000 00 00 idx=7", 0, 0},  // the next cycle
       }) {
    SCOPED_TRACE(row.trace);
    Repetitions repetitions;
    ForEachFrame((std::string("@out-only\n") + row.trace).c_str(),
                 [&](const wire::FrameView& frame) { repetitions.Add(frame); });
    EXPECT_EQ(repetitions.repeated, row.repeated);
    EXPECT_EQ(repetitions.index_changes, row.index_changes);
  }
}

TEST(SenderTally, TwoSendersAreComparedByWhatTheyAskFor) {
  struct Row {
    const char* trace;  // the first frame is of the other sender
    bool alike, copy, accepted, echo;
  };
  for (const Row& row : {
           Row{"+0us FPRD 0x1001:0x0130 01 00 idx=7\n+10us FPRD 0x1001:0x0130 01 00 idx=7", true, true, true, true},
           Row{"+0us FPRD 0x1001:0x0130 01 00 idx=7\n+10us FPRD 0x1001:0x0130 01 00 idx=8", true, true, true, false},
           Row{"+0us FPRD 0x1001:0x0130 01 00 idx=7\n+90us FPRD 0x1001:0x0130 01 00 idx=7", true, false, true, true},
           Row{"+0us FPRD 0x1001:0x0130 01 00 idx=7\n+9ms FPRD 0x1001:0x0130 01 00 idx=7", true, false, true, false},
           Row{"+0us FPRD 0x1001:0x0130 01 00 wkc=0 idx=7\n+9ms FPRD 0x1001:0x0130 01 00 idx=7", true, false, false,
               false},
           Row{"+0us FPRD 0x1001:0x0130 01 00 idx=7\n+10us BRD 0x0000 00 idx=7", false, false, false, true},
           Row{"+0us FPRD 0x1001:0x0130 01 00 idx=7\n+10us FPRD 0x1002:0x0130 01 00 idx=7", false, false, false, false},
       }) {
    SCOPED_TRACE(row.trace);
    Likeness other;
    Likeness::Match match;
    ForEachFrame((std::string("@returned-only\n") + row.trace).c_str(), [&](const wire::FrameView& frame) {
      const Likeness::Asked asked = Likeness::AskedBy(frame);
      other.Compare(asked, match);
      if (frame.ref().number == 1) other.Add(asked, match);
    });
    EXPECT_EQ(match.alike, row.alike);
    EXPECT_EQ(match.copy, row.copy);
    EXPECT_EQ(match.accepted, row.accepted);
    EXPECT_EQ(match.echo, row.echo);
    EXPECT_EQ(other.echoes, row.echo ? 1U : 0U);
  }
}

}  // namespace
}  // namespace ecaudit::bus::test
