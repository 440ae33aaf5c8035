// What one slave did with one datagram: working counters, read and written data, lost frames (esc-reference 2.1, 2.2).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/track/event_log.h"

namespace ecaudit::track::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::string_view kOne = "+1ms BRD 0x0000 11 00\n+1ms APWR 0:0x0010 01 10\n";

Decoded After(std::string_view more) {
  return Decode(std::string(kOne) + std::string(more));
}

TEST(Access, ReadAndWrite) {
  const Decoded d = After("+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPRD 0x1001:0x0400 C2 09\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
  EXPECT_EQ(d.Register(0, 0x0400), "0x09c2");
  const auto& read = d.log->accesses.back();
  EXPECT_THAT(read.read, ElementsAre(0xC2, 0x09));
  EXPECT_THAT(read.written, IsEmpty());
  EXPECT_EQ(read.acceptance, Acceptance::kAccepted);
}

TEST(Access, RefusedReadsAndWritesTeachNothing) {
  const Decoded d = After(
      "+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPWR 0x1001:0x0420 D0 07 wkc=0\n+1ms FPRD 0x1001:0x0420 FF FF wkc=0\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
  EXPECT_EQ(d.log->accesses.back().acceptance, Acceptance::kRefused);
  EXPECT_THAT(d.log->accesses.back().read, IsEmpty());
}

TEST(Access, ReadWriteByWorkingCounter) {
  // +1 for the read, +2 for the write.
  for (const std::string command : {"APRW 0:0x0420", "FPRW 0x1001:0x0420"}) {
    const std::string line = "+1ms FPWR 0x1001:0x0420 01 00\n+1ms " + command + " E8 03 -> 01 00 wkc=";
    const auto both = After(line + "3\n");
    EXPECT_THAT(both.log->accesses.back().read, ElementsAre(1, 0));
    EXPECT_THAT(both.log->accesses.back().written, ElementsAre(0xE8, 0x03));
    const auto read_only = After(line + "1\n");
    EXPECT_THAT(read_only.log->accesses.back().read, ElementsAre(1, 0));
    EXPECT_THAT(read_only.log->accesses.back().written, IsEmpty());
    EXPECT_EQ(read_only.Register(0, 0x0420), "0x0001");
    const auto write_only = After(line + "2\n");
    EXPECT_THAT(write_only.log->accesses.back().read, IsEmpty());
    EXPECT_THAT(write_only.log->accesses.back().written, ElementsAre(0xE8, 0x03));
    EXPECT_EQ(write_only.Register(0, 0x0420), "0x03e8");
    const auto none = After(line + "0\n");
    EXPECT_EQ(none.log->accesses.back().acceptance, Acceptance::kRefused);
    EXPECT_EQ(none.Register(0, 0x0420), "0x0001");
  }
}

TEST(Access, ReadWriteKeepsTheWrittenValue) {
  // The old value goes into the frame, the new one into the slave (esc-reference 2.1).
  EXPECT_EQ(After("+1ms FPRW 0x1001:0x0420 E8 03 -> 01 00\n").Register(0, 0x0420), "0x03e8");
}

TEST(Access, LastByteOfTheRegistersAndProcessMemory) {
  const Decoded d = After(
      "+1ms FPWR 0x1001:0x0FFE 01 02 03 04\n+1ms FPWR 0x1001:0xFFFE 01 02 03 04\n+1ms FPWR 0x1001:0x1000 05 06\n");
  EXPECT_EQ(d.Register(0, 0x0FFE), "0x0201");
  EXPECT_EQ(d.Register(0, 0x1000), "?") << "process memory is not kept here";
}

TEST(Access, ClockTimeIsReadByTheAddressedSlave) {
  const Decoded d = After("+1ms FRMW 0x1001:0x0910 11 22 33 44 wkc=1\n+1ms ARMW 0:0x0910 55 66 77 88 wkc=1\n");
  EXPECT_EQ(d.Register(0, 0x0910), "0x6655");
  EXPECT_THAT(d.log->accesses.back().read, ElementsAre(0x55, 0x66, 0x77, 0x88));
  EXPECT_THAT(d.log->accesses.back().written, IsEmpty()) << "the addressed slave only reads";
}

TEST(Access, ClockTimeThatWasNotRead) {
  // The others counted, the addressed one did not: the data are those of the master.
  const Decoded d = Decode(R"(
@slaves 3
+1ms BRD 0x0000 11 00
+1ms APWR 0:0x0010 01 10
+1ms FRMW 0x1001:0x0910 01 02 03 04 -> 01 02 03 04 wkc=2
)");
  EXPECT_EQ(d.Register(0, 0x0910), "?");
}

TEST(Access, ClockTimeOfACaptureWithReturnsOnly) {
  const std::string scan = "@slaves 3\n@returned-only\n+1ms BRD 0x0000 11 00\n+1ms APWR 0:0x0010 01 10\n";
  // What was sent is not there to compare; with all three counted the addressed one did, too.
  EXPECT_EQ(Decode(scan + "+1ms FRMW 0x1001:0x0910 01 02 03 04 wkc=3\n").Register(0, 0x0910), "0x0201");
  EXPECT_EQ(Decode(scan + "+1ms FRMW 0x1001:0x0910 01 02 03 04 wkc=2\n").Register(0, 0x0910), "?");
}

TEST(Access, SeveralDatagramsInTheirOrder) {
  const Decoded d =
      After("+1ms FPWR 0x1001:0x0420 01 00 & FPRD 0x1001:0x0420 02 00 & NOP & FPWR 0x1001:0x0422 03 00\n");
  const auto& a = d.log->accesses;
  ASSERT_GE(a.size(), 3U);
  EXPECT_EQ(a[a.size() - 3].address, 0x0420);
  EXPECT_EQ(a[a.size() - 2].command, wire::Command::FPRD);
  EXPECT_EQ(a.back().address, 0x0422);
}

TEST(Access, LogicalDatagrams) {
  const Decoded d = After("+1ms LRW 0x12345678 01 -> 02 wkc=3\n+1ms LRD 0x1000 05 wkc=1\n+1ms LWR 0x2000 07 wkc=0\n");
  EXPECT_THAT(d.log->Only("logical"), ElementsAre("logical LRW 0x12345678 wkc 3", "logical LRD 0x00001000 wkc 1",
                                                  "logical LWR 0x00002000 wkc 0"));
}

// --- AL control and status ------------------------------------------------------------------------------------------

TEST(AlAccess, RequestAndAnswer) {
  const Decoded d = After(R"(
+1ms FPWR 0x1001:0x0120 02 00
+1ms FPRD 0x1001:0x0130 12 00 00 00 17 00
+1ms FPRD 0x1001:0x0134 17 00
+1ms FPRD 0x1001:0x0130 12 00
)");
  EXPECT_THAT(d.log->lines,
              ElementsAre("count 1", "found 0", "address 0 = 0x1001", "sent 0 <- 0x0002",
                          "request 0 <- 0x0002 accepted", "state 0 ? -> 0x0012 code 0x0017", "code 0 0x0017"));
  EXPECT_THAT(d.log->reads, SizeIs(2));
}

TEST(AlAccess, SecondRequestBeforeTheFirstWasRead) {
  EXPECT_THAT(After("+1ms FPWR 0x1001:0x0120 02 00\n+1ms FPWR 0x1001:0x0120 02 00 wkc=0\n").log->Only("request"),
              ElementsAre("request 0 <- 0x0002 accepted", "request 0 <- 0x0002 refused"));
}

TEST(AlAccess, OneByteOnly) {
  // Old SOEM (esc-reference 14, 3).
  const Decoded d = After("+1ms FPWR 0x1001:0x0120 11\n+1ms FPRD 0x1001:0x0130 01\n");
  EXPECT_THAT(d.log->Only("request"), ElementsAre("request 0 <- 0x0011 accepted"));
  EXPECT_THAT(d.log->Only("state"), ElementsAre("state 0 ? -> 0x0001"));
}

TEST(AlAccess, WithinALongerAccess) {
  const Decoded d = After("+1ms FPRD 0x1001:0x0110 len=38\n+1ms FPWR 0x1001:0x011E 00 00 04 00\n");
  EXPECT_THAT(d.log->reads, SizeIs(1));
  EXPECT_THAT(d.log->Only("request"), ElementsAre("request 0 <- 0x0004 accepted"));
}

TEST(AlAccess, HighByteAloneIsNoRequest) {
  EXPECT_THAT(After("+1ms FPWR 0x1001:0x0121 00\n").log->Only("request"), IsEmpty());
}

// --- lost frames ----------------------------------------------------------------------------------------------------

constexpr std::string_view kThreeMore =
    "+1ms FPRD 0x1001:0x0130 01 00\n+1ms FPRD 0x1001:0x0130 01 00\n+1ms FPRD 0x1001:0x0130 01 00\n";

TEST(LostWrite, WhatItWroteIsUnknown) {
  const Decoded d =
      After("+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPWR 0x1001:0x0420 D0 07 @lost\n" + std::string(kThreeMore));
  EXPECT_THAT(d.log->Only("lost"), ElementsAre("lost 7"));
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

TEST(LostWrite, RepeatedAndTaken) {
  // The loss shows only after the repetition was taken: that is what the slave holds.
  const Decoded d = After("+1ms FPWR 0x1001:0x0420 E8 03 idx=7 @lost\n+2ms FPWR 0x1001:0x0420 E8 03 idx=7\n" +
                          std::string(kThreeMore));
  EXPECT_THAT(d.log->Only("lost"), ElementsAre("lost 5"));
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(LostWrite, ReadSince) {
  const Decoded d =
      After("+1ms FPWR 0x1001:0x0420 E8 03 @lost\n+2ms FPRD 0x1001:0x0400 len=64\n" + std::string(kThreeMore));
  EXPECT_EQ(d.Register(0, 0x0420), "0x0000");
}

TEST(LostWrite, OnlyPartlyReadSince) {
  const Decoded d =
      After("+1ms FPWR 0x1001:0x0420 E8 03 @lost\n+2ms FPRD 0x1001:0x0420 00\n" + std::string(kThreeMore));
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

TEST(LostWrite, OfAll) {
  const Decoded d = After("+1ms BWR 0x0420 E8 03\n+1ms BWR 0x0420 D0 07 @lost\n" + std::string(kThreeMore));
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

TEST(LostWrite, RequestWhoseFateIsUnknown) {
  const Decoded d = After("+1ms FPWR 0x1001:0x0120 02 00 @lost\n" + std::string(kThreeMore));
  EXPECT_THAT(d.log->Only("sent"), ElementsAre("sent 0 <- 0x0002"));
  EXPECT_THAT(d.log->Only("request"), ElementsAre("request 0 <- 0x0002 unknown"));
}

TEST(LostWrite, ReadsForgetNothing) {
  const Decoded d =
      After("+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPRD 0x1001:0x0420 00 00 @lost\n" + std::string(kThreeMore));
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
}

TEST(LostWrite, UndecidedFramesForgetToo) {
  // Whether it came back, nobody knows, so what it wrote is not known either; but it is no loss.
  const Decoded d = Decode(R"(
@two-interfaces
+1ms FPWR 0x1001:0x0420 E8 03 @lost
+1ms FPRD 0x1001:0x0130 01 00
+1ms FPRD 0x1001:0x0130 01 00
)");
  EXPECT_THAT(d.log->Only("lost"), IsEmpty());
  EXPECT_EQ(d.Register(0, 0x0420), "?");
}

// --- one direction --------------------------------------------------------------------------------------------------

TEST(OneDirection, OutboundIsInferredAtBest) {
  const Decoded d = Decode(
      "@out-only\n+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPWR 0x1001:0x0120 02 00\n+1ms FPRD 0x1001:0x0130 00 00\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8?");
  EXPECT_THAT(d.log->Only("request"), ElementsAre("request 0 <- 0x0002 assumed"));
  EXPECT_THAT(d.log->reads, IsEmpty()) << "zeros on their way to the slave are no answer";
  EXPECT_THAT(d.log->Only("sent"), IsEmpty());
}

TEST(OneDirection, ReturnedPureWritesAreComplete) {
  const Decoded d = Decode("@returned-only\n+1ms FPWR 0x1001:0x0420 E8 03\n+1ms FPRW 0x1001:0x0422 01 00 -> 02 00\n");
  EXPECT_EQ(d.Register(0, 0x0420), "0x03e8");
  EXPECT_THAT(d.log->accesses.back().read, ElementsAre(2, 0));
  EXPECT_THAT(d.log->accesses.back().written, IsEmpty()) << "what a read-write wrote went out only";
}

}  // namespace
}  // namespace ecaudit::track::test
