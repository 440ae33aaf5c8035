// Steps against expected steps: what counts as missing, moved, changed or unexpected, and which slave is which.
#include <algorithm>

#include <gtest/gtest.h>

#include "analyzers/compare/comparison.h"
#include "analyzers/compare/eni_expectation.h"
#include "analyzers/compare/slave_matches.h"
#include "analyzers/compare/startup_registers.h"
#include "cli/report/sentences.h"

namespace ecaudit::startup {
namespace {

using Kind = Deviation::Kind;
using Bytes = std::vector<std::uint8_t>;

StartupKey Download(std::uint16_t index) {
  StartupKey key;
  key.kind = StartupKey::Kind::kDownload;
  key.address = index;
  return key;
}

StartupKey Request(std::uint8_t state) {
  StartupKey key;
  key.kind = StartupKey::Kind::kRequest;
  key.address = state;
  return key;
}

/// "abc": downloads of 2000h + letter with the value 1, in frames 1, 2, ...; "S" and "O" request SAFEOP and OP.
std::vector<StartupStep> Happened(std::string_view letters) {
  std::vector<StartupStep> steps;
  for (const char letter : letters) {
    StartupStep& step = steps.emplace_back();
    step.frame.number = step.last.number = steps.size();
    step.phase = StartupPhase::kPreopParameters;
    if (letter == 'S' || letter == 'O') {
      step.key = Request(letter == 'S' ? 4 : 8);
      step.phase = letter == 'S' ? StartupPhase::kPreopToSafeop : StartupPhase::kSafeopToOp;
      continue;
    }
    step.key = Download(static_cast<std::uint16_t>(0x2000 + letter));
    step.data = {1};
    step.size = 1;
  }
  return steps;
}

std::vector<ExpectedStep> Wanted(std::string_view letters) {
  std::vector<ExpectedStep> steps;
  for (const StartupStep& step : Happened(letters)) {
    ExpectedStep& expected = steps.emplace_back();
    expected.key = step.key;
    expected.phase = step.phase;
    if (!step.data.empty()) expected.data = step.data;
  }
  return steps;
}

/// Kind, number of steps and cited frame of each deviation.
std::vector<std::tuple<Kind, std::size_t, FrameNo>> Compared(std::string_view wanted, std::string_view happened,
                                                             bool strict = false) {
  const auto expected = Wanted(wanted);
  const auto actual = Happened(happened);
  std::vector<std::tuple<Kind, std::size_t, FrameNo>> out;
  for (const Deviation& d : CompareSteps(expected, actual, false, strict)) {
    out.emplace_back(d.kind, std::max(d.expected.size(), d.actual.size()), d.frame.number);
  }
  return out;
}

using Found = std::vector<std::tuple<Kind, std::size_t, FrameNo>>;

TEST(StartupComparison, EqualStepsDoNotDiffer) {
  EXPECT_EQ(Compared("abSO", "abSO", true), Found{});
  EXPECT_EQ(Compared("", ""), Found{});
  EXPECT_EQ(Compared("aab", "aab", true), Found{});
}

TEST(StartupComparison, AMissingStepCitesTheRequestThatEndedItsPhase) {
  EXPECT_EQ(Compared("abcSO", "acSO"), (Found{{Kind::kMissing, 1, 3}}));
  EXPECT_EQ(Compared("abcSO", "aSO"), (Found{{Kind::kMissing, 2, 2}}));
  EXPECT_EQ(Compared("abcSO", "bSO"), (Found{{Kind::kMissing, 1, 2}, {Kind::kMissing, 1, 2}}));
}

TEST(StartupComparison, AStartUpThatStopsIsOneDeviation) {
  const auto expected = Wanted("abScO");
  const auto actual = Happened("abS");
  const auto found = CompareSteps(expected, actual, false, false);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].to_the_end);
  EXPECT_EQ(found[0].expected.size(), 2U);
  ASSERT_NE(found[0].previous, nullptr);
  EXPECT_EQ(found[0].previous->key, Request(4));
}

TEST(StartupComparison, MovedStepsAreOneDeviation) {
  EXPECT_EQ(Compared("abcSO", "bacSO"), (Found{{Kind::kOrder, 1, 2}}));
  EXPECT_EQ(Compared("abcdSO", "dbcaSO").size(), 1U);
  EXPECT_EQ(Compared("abcSO", "abSOc"), (Found{{Kind::kOrder, 1, 5}}));
}

TEST(StartupComparison, WhatIsNotListedCountsWhenStrict) {
  EXPECT_EQ(Compared("aSO", "abcSO"), Found{});
  EXPECT_EQ(Compared("aSO", "abcSO", true), (Found{{Kind::kUnexpected, 2, 2}}));
  EXPECT_EQ(Compared("", "a", true), (Found{{Kind::kUnexpected, 1, 1}}));
}

TEST(StartupComparison, AnotherValueIsOneDeviationAtItsPlace) {
  auto expected = Wanted("abaSO");
  expected[2].data = Bytes{2};
  const auto actual = Happened("abaSO");
  const auto found = CompareSteps(expected, actual, false, true);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, Kind::kValue);
  EXPECT_EQ(found[0].frame.number, 3U);
}

TEST(StartupComparison, ASlaveThatTheCaptureDoesNotShowIsNotMissing) {
  Expectation expectation;
  expectation.slaves.resize(2);
  expectation.slaves[1].position = 1;
  AnalysisResult result;
  result.slaves.resize(1);
  result.slaves[0].id = 0;
  result.slaves[0].startup.steps = Happened("SO");
  const auto missing = [&] {
    const Comparison comparison = Compare(expectation, result);
    return std::count_if(comparison.deviations.begin(), comparison.deviations.end(),
                         [](const Deviation& d) { return d.kind == Kind::kSlaveMissing; });
  };
  EXPECT_EQ(missing(), 0) << "how many slaves there are is not in the capture";
  result.bus.slave_count = std::uint16_t{2};
  EXPECT_EQ(missing(), 0) << "nobody met the second one";
  result.bus.slave_count = std::uint16_t{1};
  EXPECT_EQ(missing(), 1);
}

TEST(StartupComparison, NumbersFitWhateverTheWidth) {
  ExpectedStep expected;
  expected.key = Download(0x60C2);
  StartupStep actual;
  actual.key = expected.key;
  const auto fits = [&](std::int64_t number, Bytes data) {
    expected.number = number;
    actual.data = std::move(data);
    actual.size = actual.data.size();
    return HasValue(expected, actual);
  };
  EXPECT_TRUE(fits(7, {7}));
  EXPECT_TRUE(fits(7, {7, 0, 0, 0}));
  EXPECT_TRUE(fits(-3, {0xFD}));
  EXPECT_TRUE(fits(-3, {0xFD, 0xFF}));
  EXPECT_TRUE(fits(0x1234, {0x34, 0x12}));
  EXPECT_FALSE(fits(0x1234, {0x34}));
  EXPECT_FALSE(fits(-3, {0xFD, 0x00}));
  EXPECT_FALSE(fits(7, {}));
  EXPECT_FALSE(fits(7, Bytes(9, 0)));
}

/// Register writes, in frames 1, 2, ...
std::vector<StartupStep> Writes(const std::vector<std::pair<EscAddress, Bytes>>& writes) {
  std::vector<StartupStep> steps;
  for (const auto& [address, data] : writes) {
    StartupStep& step = steps.emplace_back();
    step.frame.number = step.last.number = steps.size();
    step.key.address = address;
    step.data = data;
    step.size = data.size();
  }
  return steps;
}

std::size_t Deviations(const std::vector<std::pair<EscAddress, Bytes>>& wanted,
                       const std::vector<std::pair<EscAddress, Bytes>>& happened) {
  std::vector<ExpectedStep> expected;
  for (const StartupStep& step : Writes(wanted)) {
    expected.emplace_back().key = step.key;
    expected.back().data = step.data;
  }
  const std::vector<StartupStep> actual = Writes(happened);
  return CompareSteps(expected, actual, false, true).size();
}

TEST(StartupComparison, WhatIsWrittenToARegisterCountsNotWithWhich) {
  EXPECT_EQ(Deviations({{0x0981, {3}}}, {{0x0980, {0, 3}}}), 0U);
  EXPECT_EQ(Deviations({{0x0980, {0}}, {0x0981, {3}}}, {{0x0980, {0, 3}}}), 0U);
  EXPECT_EQ(Deviations({{0x0980, {0, 3}}}, {{0x0980, {0}}, {0x0981, {3}}}), 0U);
  EXPECT_EQ(Deviations({{0x0981, {3}}}, {{0x0980, {0, 7}}}), 2U) << "another value: missing, and unexpected";
  EXPECT_EQ(Deviations({{0x0980, {0, 3}}}, {{0x0981, {3}}}), 2U) << "a part of it";
  EXPECT_EQ(Deviations({{0x0981, {3}}, {0x0981, {3}}}, {{0x0981, {3}}}), 1U) << "twice is not once";
  EXPECT_EQ(Deviations({{0x0981, {3}}, {0x0400, {1, 0}}}, {{0x0400, {1, 0}}, {0x0980, {0, 3}}}), 1U) << "elsewhere";
}

TEST(StartupComparison, OnlyWhatTheMasterSetsOfASyncManagerCounts) {
  StartupKey sm2;
  sm2.address = 0x0810;
  const Bytes written{0x00, 0x11, 0x06, 0x00, 0x64, 0x00, 0x01, 0x00};
  Bytes other = written;
  other[5] = 0x30;  // status
  other[7] = 0x01;  // PDI control
  EXPECT_TRUE(SameValue(sm2, written, other));
  other[2] = 0x08;
  EXPECT_FALSE(SameValue(sm2, written, other));
}

ExpectedSlave Device(SlavePos position, std::optional<std::uint32_t> product) {
  ExpectedSlave slave;
  slave.position = position;
  slave.product_code = product;
  return slave;
}

SlaveSummary Seen(SlavePos position, std::optional<std::uint32_t> product) {
  SlaveSummary slave;
  slave.position = position;
  slave.identity.product_code = product;
  return slave;
}

using Matches = std::vector<std::optional<std::size_t>>;

Matches Places(const std::vector<ExpectedSlave>& expected, const std::vector<SlaveSummary>& actual) {
  Matches places;
  for (const SlaveMatch& match : MatchSlaves(expected, actual)) places.push_back(match.place);
  return places;
}

TEST(MatchSlaves, ByIdentityWhereSlavesMoved) {
  const std::vector<ExpectedSlave> expected{Device(0, 1), Device(1, 2), Device(2, 3)};
  EXPECT_EQ(Places(expected, {Seen(0, 1), Seen(1, 2), Seen(2, 3)}), (Matches{0, 1, 2}));
  // A coupler more in front: everybody moves by one.
  EXPECT_EQ(Places(expected, {Seen(0, 9), Seen(1, 1), Seen(2, 2), Seen(3, 3)}), (Matches{1, 2, 3}));
  // One is gone.
  EXPECT_EQ(Places(expected, {Seen(0, 1), Seen(1, 3)}), (Matches{0, std::nullopt, 1}));
}

TEST(MatchSlaves, ByPositionWhereTheIdentityIsNotKnown) {
  const std::vector<ExpectedSlave> expected{Device(0, std::nullopt), Device(1, 2)};
  EXPECT_EQ(Places(expected, {Seen(0, 7), Seen(1, std::nullopt)}), (Matches{0, 1}));
  EXPECT_EQ(Places(expected, {Seen(0, 7)}), (Matches{0, std::nullopt}));
}

TEST(MatchSlaves, ASlaveThatWasPutElsewhereIsFound) {
  const std::vector<ExpectedSlave> expected{Device(0, 1), Device(1, 2), Device(2, 3)};
  const std::vector<SlaveMatch> swapped = MatchSlaves(expected, std::vector{Seen(0, 1), Seen(1, 3), Seen(2, 2)});
  EXPECT_EQ(swapped[1].place, 2U);
  EXPECT_EQ(swapped[2].place, 1U);
  EXPECT_TRUE(swapped[1].moved != swapped[2].moved) << "one of them changed sides";
  // Shifted by another one, nobody did.
  for (const SlaveMatch& match : MatchSlaves(expected, std::vector{Seen(0, 1), Seen(1, 9), Seen(2, 2), Seen(3, 3)})) {
    EXPECT_FALSE(match.moved);
  }
  // Somebody else is no move.
  EXPECT_EQ(Places(expected, {Seen(0, 1), Seen(1, 9), Seen(2, 3)}), (Matches{0, std::nullopt, 2}));
}

TEST(MatchSlaves, AnotherRevisionIsTheSameDevice) {
  std::vector<ExpectedSlave> expected{Device(0, 1), Device(1, 2)};
  expected[1].revision = 1;
  std::vector<SlaveSummary> actual{Seen(0, 1), Seen(1, 2)};
  actual[1].identity.revision = 2;
  EXPECT_EQ(Places(expected, actual), (Matches{0, 1}));
}

/// Steps that all have to succeed.
std::vector<ExpectedStep> Succeeding(std::string_view letters) {
  std::vector<ExpectedStep> steps = Wanted(letters);
  for (ExpectedStep& step : steps) step.succeeds = true;
  return steps;
}

/// An expectation of one slave, and a capture that ends two seconds behind its start-up.
struct OneSlave {
  Expectation expectation;
  AnalysisResult result;

  OneSlave(std::string_view wanted, std::string_view happened) {
    expectation.slaves.resize(1);
    expectation.slaves[0].steps = Succeeding(wanted);
    SlaveSummary& slave = result.slaves.emplace_back();
    slave.id = 0;
    slave.startup.steps = Happened(happened);
    slave.startup.reached = 8;
    slave.startup.end.number = happened.size();
    slave.startup.end.has_time = result.capture.last.has_time = true;
    result.capture.last.number = 1000;
    result.capture.last.time = 2'000'000'000;
  }

  StartupStep& Step(std::size_t at) { return result.slaves[0].startup.steps[at]; }

  Found Run() {
    out = Compare(expectation, result);
    Found found;
    for (const Deviation& d : out.deviations) {
      found.emplace_back(d.kind, std::max(d.expected.size(), d.actual.size()), d.frame.number);
    }
    return found;
  }
  [[nodiscard]] std::vector<std::string> Reasons() const {
    std::vector<std::string> reasons;
    for (const NotCompared& entry : out.not_compared) reasons.push_back(report::TextOf(entry.reason));
    return reasons;
  }
  Comparison out;
};

TEST(StartupOutcomes, AStepThatHasToSucceedAndIsRefusedFailed) {
  for (const StartupOutcome outcome : {StartupOutcome::kRefused, StartupOutcome::kUnanswered}) {
    OneSlave bus("abSO", "abSO");
    bus.Step(1).outcome = outcome;
    EXPECT_EQ(bus.Run(), (Found{{Kind::kFailed, 1, 2}}));
    // An expectation that does not hold outcomes judges what was sent, no more.
    for (ExpectedStep& step : bus.expectation.slaves[0].steps) step.succeeds = false;
    EXPECT_EQ(bus.Run(), Found{});
    EXPECT_EQ(bus.Reasons(), std::vector<std::string>{});
  }
}

TEST(StartupOutcomes, WhatIsDoneAgainWithSuccessDidNotFail) {
  OneSlave bus("abSO", "abbSO");
  bus.Step(1).outcome = StartupOutcome::kRefused;
  EXPECT_EQ(bus.Run(), Found{});
  bus.Step(1).outcome = StartupOutcome::kUnknown;
  EXPECT_EQ(bus.Run(), Found{});
  EXPECT_EQ(bus.Reasons(), std::vector<std::string>{});
}

TEST(StartupOutcomes, WhatTheCaptureDoesNotShowIsNoFailure) {
  OneSlave bus("abSO", "abSO");
  bus.Step(1).outcome = StartupOutcome::kUnknown;
  EXPECT_EQ(bus.Run(), Found{});
  ASSERT_EQ(bus.Reasons().size(), 1U);
  EXPECT_EQ(bus.out.not_compared[0].only, Kind::kFailed);
  // A request whose state was passed was followed.
  bus.Step(1).outcome = StartupOutcome::kDone;
  bus.Step(2).outcome = StartupOutcome::kUnknown;
  EXPECT_EQ(bus.Run(), Found{});
  EXPECT_EQ(bus.Reasons(), std::vector<std::string>{});
}

TEST(StartupOutcomes, WhatFollowsFromAStateThatIsNotReachedIsToldWithIt) {
  // The master goes on, ...
  OneSlave bus("aSbO", "aSbO");
  bus.result.slaves[0].startup.reached = 2;
  bus.Step(1).outcome = StartupOutcome::kRefused;
  bus.Step(3).outcome = StartupOutcome::kUnanswered;
  EXPECT_EQ(bus.Run(), (Found{{Kind::kFailed, 2, 2}}));
  // ... and it does not.
  OneSlave stops("aSbO", "aS");
  stops.result.slaves[0].startup.reached = 2;
  stops.Step(1).outcome = StartupOutcome::kRefused;
  EXPECT_EQ(stops.Run(), (Found{{Kind::kFailed, 1, 2}}));
  EXPECT_EQ(stops.out.deviations[0].behind.size(), 2U);
}

TEST(StartupOutcomes, AStepWithAnotherValueIsOneDeviationWhateverCameOfIt) {
  OneSlave bus("abSO", "abSO");
  bus.Step(1).data = {2};
  bus.Step(1).outcome = StartupOutcome::kRefused;
  EXPECT_EQ(bus.Run(), (Found{{Kind::kValue, 1, 2}}));
}

TEST(StartupOutcomes, AMasterThatIsAtItWhenTheCaptureEndsHasLeftNothingOut) {
  OneSlave bus("abSO", "ab");
  EXPECT_EQ(bus.Run().size(), 1U);
  bus.result.capture.last.time = 50'000'000;
  EXPECT_EQ(bus.Run(), Found{});
  EXPECT_EQ(bus.Reasons(), std::vector<std::string>{"the capture ends during the start-up"});
  EXPECT_EQ(bus.out.cut, 1U);
  // It is at another slave: this one has its turn later.
  bus.result.slaves[0].startup.end.time = -1'000'000'000;
  EXPECT_EQ(bus.Run().size(), 1U);
  SlaveSummary other = bus.result.slaves[0];
  other.id = other.position = 1;
  other.startup.end.time = 0;
  bus.result.slaves.push_back(other);
  EXPECT_EQ(bus.Run(), Found{});
  // What was left out before the last step is missing all the same.
  OneSlave gap("abcSO", "acS");
  gap.result.capture.last.time = 50'000'000;
  EXPECT_EQ(gap.Run(), (Found{{Kind::kMissing, 1, 3}}));
}

TEST(StartupComparison, AnotherRevisionIsOneOfTheDevice) {
  OneSlave bus("aSO", "aSO");
  bus.expectation.slaves[0].revision = 0x10000;
  EXPECT_EQ(bus.Run(), Found{}) << "not known";
  bus.result.slaves[0].identity.revision = 0x10000;
  EXPECT_EQ(bus.Run(), Found{});
  bus.result.slaves[0].identity.revision = 0x10001;
  ASSERT_EQ(bus.Run().size(), 1U);
  EXPECT_EQ(bus.out.deviations[0].kind, Kind::kRevision);
  EXPECT_EQ(bus.out.deviations[0].revision, 0x10001U);
}

TEST(StartupComparison, LogicalAddressesThatAreShiftedWithTheBusAreNotWrong) {
  OneSlave bus("aSO", "aSO");
  bus.expectation.slaves[0].steps[0].key = StartupKey{StartupKey::Kind::kWrite, false, 0, 0x0600};
  bus.expectation.slaves[0].steps[0].data = Bytes{8, 0, 0, 0, 6, 0, 0, 7, 0, 0x12, 0, 2, 1, 0, 0, 0};
  bus.Step(0).key = bus.expectation.slaves[0].steps[0].key;
  bus.Step(0).data = {2, 0, 0, 0, 6, 0, 0, 7, 0, 0x12, 0, 2, 1, 0, 0, 0};
  bus.Step(0).size = 16;
  EXPECT_EQ(bus.Run(), (Found{{Kind::kValue, 1, 1}})) << "the same bus has another layout";
  // A slave that the expectation does not list shifts the others.
  SlaveSummary extra;
  extra.id = extra.position = 1;
  bus.result.slaves.push_back(extra);
  EXPECT_EQ(bus.Run(), Found{});
  EXPECT_EQ(bus.Reasons().size(), 2U) << "the new slave, and the logical address";
  // Another length is wrong on any bus.
  bus.Step(0).data[4] = 4;
  EXPECT_EQ(bus.Run(), (Found{{Kind::kValue, 1, 1}}));
}

TEST(EniExpectation, TakesWritesOfTheWayUp) {
  device::EniConfig eni;
  device::EniSlave& slave = eni.slaves.emplace_back();
  slave.auto_increment = 0;
  const auto add = [&](std::vector<std::string> transitions, EscAddress ado, Bytes data) {
    device::EniInitCommand& command = slave.init_commands.emplace_back();
    command.transitions = std::move(transitions);
    command.command = wire::Command::FPWR;
    command.ado = ado;
    command.data = std::move(data);
  };
  add({"SP", "PI"}, 0x0810, Bytes(8, 0));                  // downwards
  add({"IP"}, 0x0800, {0, 0x10, 0x80, 0, 0x26, 0, 1, 0});  // SM0
  add({"IP"}, 0x0502, {0, 1, 8, 0, 0, 0});                 // EEPROM command: not configured
  add({"IP"}, 0x0120, {2, 0});                             // PREOP
  add({"PS"}, 0x0990, Bytes(8, 0));                        // start time: put in by the master
  add({"PS"}, 0x0120, {4, 0});                             // SAFEOP
  device::EniSdoCommand& sdo = slave.sdo_commands.emplace_back();
  sdo.transitions = {"PS"};
  sdo.index = 0x6060;
  sdo.data = {7};

  const Expectation expectation = ExpectationOf(eni, "machine.xml");
  EXPECT_TRUE(expectation.separate_mailbox);
  ASSERT_EQ(expectation.slaves.size(), 1U);
  const std::vector<ExpectedStep>& steps = expectation.slaves[0].steps;
  ASSERT_EQ(steps.size(), 5U);
  EXPECT_EQ(steps[0].key.address, 0x0800U);
  EXPECT_EQ(steps[1].key, Request(2));
  EXPECT_EQ(steps[2].key.address, 0x0990U);
  EXPECT_TRUE(steps[2].any_value());
  EXPECT_EQ(steps[3].key, Request(4));
  EXPECT_EQ(steps[4].key, Download(0x6060));
  EXPECT_EQ(steps[4].data, Bytes{7});
}

}  // namespace
}  // namespace ecaudit::startup
