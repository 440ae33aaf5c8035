// Two captures side by side: what is done once more, and what one of them cannot show.
#include "analyzers/compare/compare_captures.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/judge/refusal_reasons.h"
#include "cli/report/sentences.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::diff {
namespace {

AnalysisResult ResultOf(const std::string& lines) {
  const auto trace = test::Trace::Parse(lines);
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return {};
  }
  return Analyse(*trace->Source(), AnalysisOptions{});
}

std::string State(int state) {
  const std::string digit = std::to_string(state);
  return "+1ms FPWR 0x1001:0x0120 0" + digit + " 00\n+1ms FPRD 0x1001:0x0130 0" + digit + " 00\n";
}

const std::string kAddress =
    "@slaves 1\n"
    "+1ms BRD 0x0000 11\n"
    "+1ms APWR 0:0x0010 01 10\n"
    "+1ms FPRD 0x1001:0x0130 01 00\n";
const std::string kMailbox = "+1ms FPWR 0x1001:0x0800 00 10 80 00 26 00 01 00\n";
const std::string kShortMailbox = "+1ms FPWR 0x1001:0x0800 00 10 40 00 26 00 01 00\n";
const std::string kUp = State(2) + State(4) + State(8);

/// "what | in A | in B" of the steps.
std::vector<std::string> Steps(const CaptureDiff& diff) {
  std::vector<std::string> steps;
  for (const Difference& d : diff.differences) {
    if (d.area == Area::kStep) steps.push_back(d.what + " | " + d.in_a + " | " + d.in_b);
  }
  return steps;
}

CaptureDiff Compared(const AnalysisResult& a, const AnalysisResult& b) {
  return Compare(a, b, {&report::TitleOf, &SettingsOfRefusal});
}

using Names = std::vector<std::string>;

TEST(CompareCaptures, ARequestMoreIsSaidAsSuch) {
  const AnalysisResult a = ResultOf(kAddress + kMailbox + kUp);
  const AnalysisResult b =
      ResultOf(kAddress + "+1ms FPWR 0x1001:0x0120 08 00\n+1ms FPRD 0x1001:0x0130 11 00 00 00 11 00\n" +
               "+1ms FPWR 0x1001:0x0120 11 00\n+1ms FPRD 0x1001:0x0130 01 00\n" + kMailbox + kUp);
  const CaptureDiff there = Compared(a, b);
  EXPECT_EQ(Steps(there), (Names{"request of OP | once | once more, in INIT -> PREOP",
                                 "request of INIT | not for this slave alone | done"}));
  EXPECT_EQ(Steps(Compared(b, a)), (Names{"request of OP | once more, in INIT -> PREOP | once",
                                          "request of INIT | done | not for this slave alone"}));
  // Both are cited.
  const auto op = std::find_if(there.differences.begin(), there.differences.end(),
                               [](const Difference& d) { return d.what == "request of OP"; });
  ASSERT_NE(op, there.differences.end());
  EXPECT_EQ(op->frame_a, a.slaves[0].startup.steps.back().frame.number);
  EXPECT_EQ(op->frame_b, b.slaves[0].startup.steps[1].frame.number);
}

/// What is relevant, in order.
Names Relevant(const CaptureDiff& diff) {
  Names names;
  for (const Difference& d : diff.differences) {
    if (d.relevant) names.push_back(d.what);
  }
  return names;
}

const std::string kOutputs = "+1ms FPWR 0x1001:0x0810 00 11 06 00 64 00 01 00\n";
const std::string kLongOutputs = "+1ms FPWR 0x1001:0x0810 00 11 08 00 64 00 01 00\n";
const std::string kWatchdog = "+1ms FPWR 0x1001:0x0420 E8 03\n";
const std::string kOtherWatchdog = "+1ms FPWR 0x1001:0x0420 64 00\n";

/// PREOP, then SAFEOP refused with this code.
std::string RefusedWith(const std::string& code) {
  return "+1ms FPWR 0x1001:0x0120 04 00\n+1ms FPRD 0x1001:0x0130 12 00 00 00 " + code + " 00\n";
}

TEST(CompareCaptures, TheCodeOfTheRefusalDecidesWhatIsRelevant) {
  const std::string begin = kAddress + kMailbox + State(2);
  const AnalysisResult a = ResultOf(begin + kOutputs + kWatchdog + State(4) + State(8));
  const AnalysisResult lengths = ResultOf(begin + kLongOutputs + kOtherWatchdog + RefusedWith("1D"));
  EXPECT_EQ(Relevant(Compared(a, lengths)), Names{"write of SM2 (0x0810)"});
  EXPECT_EQ(Relevant(Compared(lengths, a)), Names{"write of SM2 (0x0810)"});
  EXPECT_EQ(Compared(a, lengths).failed, "SAFEOP refused with 0x001d");
  // Near miss: the same differences, and a code about something else.
  const AnalysisResult modules = ResultOf(begin + kLongOutputs + kOtherWatchdog + RefusedWith("70"));
  EXPECT_TRUE(Relevant(Compared(a, modules)).empty());
  // A code without a row is about what a slave checks at the request.
  const AnalysisResult unspecified = ResultOf(begin + kLongOutputs + kOtherWatchdog + RefusedWith("01"));
  EXPECT_EQ(Relevant(Compared(a, unspecified)), Names{"write of SM2 (0x0810)"});
}

TEST(CompareCaptures, WhatComesAfterTheRefusalIsNotRelevant) {
  const std::string begin = kAddress + kMailbox + State(2);
  const AnalysisResult a = ResultOf(begin + kOutputs + State(4) + State(8));
  const AnalysisResult b = ResultOf(begin + kOutputs + RefusedWith("1D") + kLongOutputs);
  EXPECT_TRUE(Relevant(Compared(a, b)).empty());
}

TEST(CompareCaptures, EachCodeWithReasonsIsAboutSettings) {
  for (const std::uint16_t code : CodesWithReasons()) EXPECT_FALSE(SettingsOfRefusal(code, 0).empty()) << code;
  EXPECT_TRUE(SettingsOfRefusal(0x0011, 0).empty());
}

TEST(CompareCaptures, AValueThatIsPutRightLaterIsADifference) {
  const AnalysisResult a = ResultOf(kAddress + kMailbox + kUp);
  const AnalysisResult b = ResultOf(kAddress + kShortMailbox + kMailbox + kUp);
  EXPECT_EQ(Steps(Compared(a, b)),
            (Names{"write of SM0 (0x0800) | length 128 bytes | length 64 bytes, later as in A"}));
}

TEST(CompareCaptures, WhatTheOtherNeverDoesIsNotDone) {
  const AnalysisResult a = ResultOf(kAddress + kMailbox + kUp);
  const AnalysisResult b = ResultOf(kAddress + kMailbox + "+1ms FPWR 0x1001:0x0420 E8 03\n" + kUp);
  const Names steps = Steps(Compared(a, b));
  ASSERT_EQ(steps.size(), 1U);
  EXPECT_NE(steps[0].find(" | not done | done"), std::string::npos) << steps[0];
}

TEST(CompareCaptures, AnOutboundCaptureOfTheSameRunIsTheSame) {
  const std::string lines = kAddress.substr(kAddress.find('\n') + 1) + kMailbox + kUp;
  const CaptureDiff diff = Compared(ResultOf("@slaves 1\n" + lines), ResultOf("@out-only\n@slaves 1\n" + lines));
  EXPECT_FALSE(diff.different());
  EXPECT_TRUE(diff.compared);
  EXPECT_FALSE(diff.notes.empty());
}

TEST(CompareCaptures, ASlaveThatACaptureCannotShowIsNotMissing) {
  const AnalysisResult a = ResultOf(kAddress + kMailbox + kUp);
  // In operation, nobody is addressed.
  const AnalysisResult b = ResultOf("@slaves 1\n+1ms LRW 0x10000 00 00 -> 00 00\n+1ms LRW 0x10000 00 00 -> 00 00\n");
  ASSERT_TRUE(b.slaves.empty());
  const CaptureDiff diff = Compared(a, b);
  EXPECT_TRUE(std::none_of(diff.differences.begin(), diff.differences.end(),
                           [](const Difference& d) { return d.area == Area::kBus; }));
  EXPECT_FALSE(diff.compared);
}

TEST(CompareCaptures, OtherDatagramsForTheSameDataAreADifference) {
  std::string one, two;
  for (int i = 0; i < 25; ++i) {
    one += "+1ms LRW 0x10000 00 00 -> 00 00\n";
    two += "+1ms LRW 0x10000 00 -> 00\n+1us LRW 0x10001 00 -> 00\n";
  }
  const CaptureDiff diff =
      Compared(ResultOf(kAddress + kMailbox + kUp + one), ResultOf(kAddress + kMailbox + kUp + two));
  EXPECT_TRUE(std::any_of(diff.differences.begin(), diff.differences.end(), [](const Difference& d) {
    return d.what == "datagrams that carry the process data" && d.in_a == "LRW" && d.in_b == "2 LRW" && d.counts;
  }));
  EXPECT_TRUE(std::any_of(diff.notes.begin(), diff.notes.end(), [](const std::string& note) {
    return note == "slave 0: the identity is not in either capture, so matched by position";
  }));
}

TEST(CompareCaptures, WhatReadsAlikeIsNoDifference) {
  const AnalysisResult a = ResultOf(kAddress + kMailbox + kUp);
  const AnalysisResult b = ResultOf("@slaves 2\n" + kAddress.substr(kAddress.find('\n') + 1) +
                                    "+1ms APWR 1:0x0010 02 10\n" + kMailbox + kUp);
  const CaptureDiff diff = Compared(a, b);
  ASSERT_FALSE(diff.differences.empty());
  EXPECT_EQ(diff.differences.front().what, "slaves on the bus");
  for (const Difference& d : diff.differences) EXPECT_NE(d.in_a, d.in_b) << d.what;
}

TEST(CompareCaptures, ASlaveThatIsNotThereIsADifference) {
  const AnalysisResult a =
      ResultOf("@slaves 2\n+1ms BRD 0x0000 11\n+1ms APWR 0:0x0010 01 10\n+1ms APWR 1:0x0010 02 10\n" + kMailbox + kUp);
  const AnalysisResult b = ResultOf(kAddress + kMailbox + kUp);
  const CaptureDiff diff = Compared(a, b);
  EXPECT_TRUE(std::any_of(diff.differences.begin(), diff.differences.end(),
                          [](const Difference& d) { return d.area == Area::kBus && d.in_b == "not on the bus"; }));
}

/// Register 0x0300 of the slave, read twice: the receive errors of port 0 rise, or do not.
std::string LinkErrors(const std::string& later) {
  const std::string rest = " 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00\n";
  return "+1ms FPRD 0x1001:0x0300 00 00" + rest + "+1s FPRD 0x1001:0x0300 00 " + later + rest;
}

TEST(CompareCaptures, AFindingLeadsWhereNoOtherValueExplains) {
  const std::string watchdog = kWatchdog;
  const AnalysisResult a = ResultOf(kAddress + kMailbox + kUp + LinkErrors("05"));
  const AnalysisResult b = ResultOf(kAddress + kMailbox + watchdog + kUp + LinkErrors("00"));
  const CaptureDiff diff = Compared(a, b);
  ASSERT_GE(diff.differences.size(), 2U);
  EXPECT_EQ(diff.differences.front().what, "bus-link-errors");
  EXPECT_TRUE(diff.findings_lead);
  // Near miss: a setting has another value.
  const CaptureDiff other = Compared(a, ResultOf(kAddress + kShortMailbox + watchdog + kUp + LinkErrors("00")));
  EXPECT_EQ(other.differences.front().what, "write of SM0 (0x0800)");
  EXPECT_FALSE(other.findings_lead);
}

const std::string kInit =
    "@slaves 1\n+1ms BRD 0x0000 11\n+1ms APWR 0:0x0010 01 10\n+1ms FPRD 0x1001:0x0130 01 00 00 00 00 00\n";

/// The identity and the mailbox words, then PREOP, which the slave reaches or does not.
std::string WithEeprom(const std::string& identity, const std::string& mailbox, bool preop) {
  const std::string state = preop ? "02" : "01";
  return kInit + "+1ms FPWR 0x1001:0x0502 00 01 08 00 00 00\n+1ms FPRD 0x1001:0x0502 40 00 08 00 00 00 " + identity +
         "\n+1ms FPWR 0x1001:0x0502 00 01 18 00 00 00\n+1ms FPRD 0x1001:0x0502 40 00 18 00 00 00 " + mailbox +
         "\n+1ms FPWR 0x1001:0x0120 02 00\n" + "+1s FPRD 0x1001:0x0130 " + state + " 00 00 00 00 00  times=4\n";
}
const std::string kErased = "FF FF FF FF FF FF FF FF";

TEST(CompareCaptures, ASlaveWithABlankEepromIsTheOneAtItsPlace) {
  const AnalysisResult blank = ResultOf(WithEeprom(kErased, kErased, false));
  const AnalysisResult good = ResultOf(WithEeprom("02 00 00 00 52 30 F0 03", "00 10 80 00 80 10 80 00", true));
  for (const bool blank_first : {true, false}) {
    const CaptureDiff diff = blank_first ? Compared(blank, good) : Compared(good, blank);
    ASSERT_EQ(diff.pairs.size(), 1U);
    EXPECT_TRUE(diff.pairs[0].a != nullptr && diff.pairs[0].b != nullptr);
    EXPECT_EQ(diff.differences.front().what, "identity in the EEPROM");
    EXPECT_EQ(diff.failed, "PREOP not reached");
    // What the refused request follows from leads.
    EXPECT_EQ(Relevant(diff).front(), "eeprom-invalid");
  }
  // Near miss: another device there is another slave.
  const AnalysisResult other = ResultOf(WithEeprom("02 00 00 00 52 2C 4C 04", "00 10 80 00 80 10 80 00", true));
  EXPECT_EQ(Compared(other, good).pairs.size(), 2U);
}

}  // namespace
}  // namespace ecaudit::diff
