#include "analyzers/model/event_unit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "decoder/device/event_names.h"
#include "decoder/device/profile_registry.h"
#include "tests/support/trace_builder.h"

namespace ecaudit {
namespace {

using test::Bytes;
using test::Trace;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::uint16_t kDlStatus = 0x0004;  // bits of 0x0210, esc-reference 4.4
constexpr std::uint16_t kAlStatus = 0x0008;

AnalysisResult Analyse(const Trace& trace) {
  return ecaudit::Analyse(*trace.Source(), {});
}

/// `count` slaves in INIT, met at 0x1001, 0x1002, ...
Trace Scanned(std::uint16_t count) {
  Trace trace;
  trace.Slaves(count);
  trace.After(1000).Brd(0x0130, {1, 0});
  for (std::uint16_t i = 0; i < count; ++i) trace.After(1000).Apwr(i, 0x0010, {static_cast<std::uint8_t>(1 + i), 0x10});
  return trace;
}

TEST(EventField, IsSilentWithoutEvents) {
  const Trace trace = Scanned(1);
  const AnalysisResult result = Analyse(trace);
  EXPECT_THAT(result.bus.events, IsEmpty());
  ASSERT_EQ(result.slaves.size(), 1U);
  EXPECT_THAT(result.slaves[0].events.signalled, IsEmpty());
  EXPECT_FALSE(result.slaves[0].events.ecat_mask);
  EXPECT_FALSE(result.slaves[0].events.al_request);
}

TEST(EventField, BitFromTheFirstFrameOnIsOneEventOfTheOnlySlave) {
  Trace trace;
  trace.After(1000).Bwr(0x0300, Bytes(8)).Irq(kDlStatus).Mark("first");
  trace.After(1000).Brd(0x0000, {0x11}).Irq(kDlStatus);
  trace.After(1000).Apwr(0, 0x0010, {1, 0x10}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1001, 0x0110, {0x11, 0x55}).Irq(kDlStatus).Mark("last");
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0});
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.bus.events.size(), 1U);
  const EventBitSummary& bit = result.bus.events[0];
  EXPECT_EQ(bit.bit, 2);
  EXPECT_EQ(bit.name, "DL status");
  EXPECT_EQ(bit.raised, 1U);
  EXPECT_EQ(bit.frames, 4U);
  EXPECT_EQ(bit.first.number, trace.Returned("first"));
  EXPECT_EQ(bit.last.number, trace.Returned("last"));
  EXPECT_TRUE(bit.from_start);
  EXPECT_FALSE(bit.at_end);
  ASSERT_EQ(result.slaves[0].events.signalled.size(), 1U);
  EXPECT_EQ(result.slaves[0].events.signalled[0].frames, 4U);
  EXPECT_FALSE(result.slaves[0].events.signalled[0].inferred);
}

TEST(EventField, BitAtTheEndIsCounted) {
  Trace trace = Scanned(1);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0});
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0}).Irq(kDlStatus | kAlStatus);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0}).Irq(kDlStatus);
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.bus.events.size(), 2U);
  EXPECT_EQ(result.bus.events[0].raised, 2U);
  EXPECT_EQ(result.bus.events[0].frames, 3U);
  EXPECT_FALSE(result.bus.events[0].from_start);
  EXPECT_TRUE(result.bus.events[0].at_end);
  EXPECT_EQ(result.bus.events[1].bit, 3);
  EXPECT_EQ(result.bus.events[1].frames, 1U);
  EXPECT_FALSE(result.bus.events[1].at_end);
}

TEST(EventField, DatagramsOfAFrameAreOneFrame) {
  Trace trace = Scanned(1);
  trace.After(1000).Fprd(0x1001, 0x0110, {0x11, 0}).Irq(kDlStatus).Fprd(0x1001, 0x0012, {0, 0}).Irq(kAlStatus);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0});
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.bus.events.size(), 2U);
  EXPECT_EQ(result.bus.events[0].frames, 1U);
  EXPECT_EQ(result.bus.events[1].frames, 1U);
}

/// Of several slaves, the one whose answer makes the bit go.
TEST(EventField, ReadThatMakesABitGoTellsTheSlave) {
  Trace trace = Scanned(3);
  trace.After(1000).Fprd(0x1003, 0x0012, {0, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1001, 0x0110, {0x11, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1002, 0x0110, {0x11, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1003, 0x0110, {0x11, 0});
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.slaves.size(), 3U);
  EXPECT_THAT(result.slaves[0].events.signalled, IsEmpty());
  EXPECT_THAT(result.slaves[2].events.signalled, IsEmpty());
  ASSERT_EQ(result.slaves[1].events.signalled.size(), 1U);
  EXPECT_EQ(result.slaves[1].events.signalled[0].frames, 3U);
  EXPECT_TRUE(result.slaves[1].events.signalled[0].inferred);
}

TEST(EventField, ReadsOfSeveralSlavesInOneFrameTellNobody) {
  Trace trace = Scanned(2);
  trace.After(1000).Fprd(0x1001, 0x0110, {0x11, 0}).Irq(kDlStatus).Fprd(0x1002, 0x0110, {0x11, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0});
  trace.After(1000).Brd(0x0130, {1, 0}).Irq(kAlStatus).Fprd(0x1002, 0x0130, {1, 0}).Irq(kAlStatus);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0});
  // Another register says nothing about who it was.
  trace.After(1000).Fprd(0x1001, 0x0130, {1, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0});
  const AnalysisResult result = Analyse(trace);
  EXPECT_EQ(result.bus.events.size(), 2U);
  for (const SlaveSummary& slave : result.slaves) EXPECT_THAT(slave.events.signalled, IsEmpty());
}

TEST(EventField, MasksTellTheSlave) {
  Trace trace = Scanned(2);
  trace.After(1000).Bwr(0x0200, {0x04, 0});
  trace.After(1000).Fpwr(0x1002, 0x0200, {0, 0});
  trace.After(1000).Fprd(0x1002, 0x0012, {0, 0}).Irq(kDlStatus);
  trace.After(1000).Fpwr(0x1002, 0x0200, {0x0C, 0}).Irq(kDlStatus);
  trace.After(1000).Fprd(0x1002, 0x0012, {0, 0}).Irq(kDlStatus);  // it may be both now, but it never went
  trace.After(1000).Fprd(0x1002, 0x0012, {0, 0}).Irq(kAlStatus);
  trace.After(1000).Fprd(0x1002, 0x0012, {0, 0});
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.slaves.size(), 2U);
  ASSERT_EQ(result.slaves[0].events.signalled.size(), 1U);
  EXPECT_EQ(result.slaves[0].events.signalled[0].bit, 2);
  EXPECT_FALSE(result.slaves[0].events.signalled[0].inferred);
  ASSERT_EQ(result.slaves[1].events.signalled.size(), 1U);
  EXPECT_EQ(result.slaves[1].events.signalled[0].bit, 3);
  ASSERT_TRUE(result.slaves[1].events.ecat_mask);
  EXPECT_EQ(result.slaves[1].events.ecat_mask->value, 0x0CU);
  EXPECT_THAT(result.slaves[1].events.ecat_mask->names, ElementsAre("DL status", "AL status"));
}

TEST(EventField, MaskWrittenToAllBeforeTheSlaveWasMetCounts) {
  Trace trace;
  trace.After(1000).Brd(0x0000, {0x11});
  trace.After(1000).Bwr(0x0200, {0x04, 0});
  trace.After(1000).Apwr(0, 0x0010, {1, 0x10});
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].events.ecat_mask);
  EXPECT_EQ(result.slaves[0].events.ecat_mask->value, 4U);
  EXPECT_EQ(result.slaves[0].events.ecat_mask->frame, 0U);
}

TEST(EventField, BitsThatTheMasterSentAreNotTheSlaves) {
  Trace trace = Scanned(1);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0}).SentIrq(0x8004).Irq(0x800C);
  EXPECT_EQ(Analyse(trace).bus.events.size(), 1U);
  EXPECT_EQ(Analyse(trace).bus.events.at(0).bit, 3);
  trace.Direction(test::Copies::kReturned);
  trace.After(1000).Fprd(0x1001, 0x0012, {0, 0}).SentIrq(0x8000).Irq(0x8000);
  const AnalysisResult result = Analyse(trace);
  ASSERT_EQ(result.bus.events.size(), 2U);  // the returned copy alone cannot tell
  EXPECT_EQ(result.bus.events[1].name, "bit 15");
}

TEST(EventRegisters, AreKeptAsReadLast) {
  Trace trace = Scanned(2);
  trace.After(1000).Fprd(0x1001, 0x0220, {0x21, 0x0C, 0, 0});
  trace.After(1000).Fprd(0x1001, 0x0220, {0x02, 0x01}).Mark("read");
  trace.After(1000).Fpwr(0x1001, 0x0220, {0xFF, 0xFF, 0xFF, 0xFF}).Wkc(0);  // read-only for the master
  trace.After(1000).Brd(0x0220, {0xFF, 0xFF, 0, 0});                        // of all: says nothing of one
  trace.After(1000).Fprd(0x1001, 0x0204, {0x05, 0, 0, 0});
  trace.After(1000).Fprd(0x1001, 0x0210, {0x0C, 0});
  const AnalysisResult result = Analyse(trace);
  const EventSummary& events = result.slaves.at(0).events;
  ASSERT_TRUE(events.al_request);
  EXPECT_EQ(events.al_request->value, 0x0102U);
  EXPECT_EQ(events.al_request->known_bits, 0xFFFFU);
  EXPECT_EQ(events.al_request->frame, trace.Returned("read"));
  EXPECT_THAT(events.al_request->names, ElementsAre("DC latch", "SM0"));
  ASSERT_TRUE(events.al_mask);
  EXPECT_THAT(events.al_mask->names, ElementsAre("AL control", "SYNC0"));
  ASSERT_TRUE(events.ecat_request);
  EXPECT_THAT(events.ecat_request->names, ElementsAre("DL status", "AL status"));
  EXPECT_THAT(result.bus.events, IsEmpty());
  EXPECT_FALSE(result.slaves.at(1).events.al_request);
}

/// al_event_bits.csv: what AKD and Pilz call the bits of 0x0220, and that Pilz has the watchdog where others have the
/// DC latch. Where a manual has no name for a bit, or one row for several, the standard's name stands.
TEST(EventNames, AreTheFamilys) {
  const auto name = [](std::string_view profile, EscAddress address, unsigned bit) {
    return device::EventBitName(*device::BuiltinProfile(profile), address, bit);
  };
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0220, 0), "AL Control Event");
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0220, 1), "DC latch");
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0220, 5), "EEPROM emulation event");
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0220, 6), "watchdog");
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0220, 10), "Sync Manager 2 Event");
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0220, 13), "SM5");
  EXPECT_EQ(name("kollmorgen-akd-2011", 0x0204, 9), "Sync Manager 1 Event (Mail In)");
  EXPECT_EQ(name("pilz-pmcprotego-d", 0x0220, 1), "Sync Manager Watchdog Event");
  EXPECT_EQ(name("pilz-pmcprotego-d", 0x0204, 1), "DC latch");
  EXPECT_EQ(name("generic", 0x0220, 2), "SYNC0");
  EXPECT_EQ(name("generic", 0x0220, 31), "bit 31");
}

}  // namespace
}  // namespace ecaudit
