#include "cli/report/finding_order.h"

#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::MakeFinding;

/// (index, depth) in reading order.
std::vector<std::pair<int, int>> Order(const CaptureReport& capture) {
  std::vector<std::pair<int, int>> out;
  for (const OrderedFinding& f : OrderForReading(capture)) out.emplace_back(static_cast<int>(f.index), f.depth);
  return out;
}

using Pairs = std::vector<std::pair<int, int>>;

TEST(FindingOrder, BySeverityThenFrame) {
  CaptureReport capture;
  capture.result.findings = {MakeFinding("a", Severity::kInfo, 0, 1), MakeFinding("b", Severity::kError, 0, 9),
                             MakeFinding("c", Severity::kWarning, 0, 2), MakeFinding("d", Severity::kError, 0, 3)};
  EXPECT_EQ(Order(capture), (Pairs{{3, 0}, {1, 0}, {2, 0}, {0, 0}}));
}

TEST(FindingOrder, WhatIsAsideComesAfterItsEquals) {
  CaptureReport capture;
  capture.result.findings = {MakeFinding("aside", Severity::kError, 0, 1),
                             MakeFinding("warning", Severity::kWarning, 0, 2),
                             MakeFinding("error", Severity::kError, 0, 9)};
  capture.result.findings[0].aside = true;
  EXPECT_EQ(Order(capture), (Pairs{{2, 0}, {0, 0}, {1, 0}}));
}

TEST(FindingOrder, AMildCauseRisesWithItsConsequence) {
  CaptureReport capture;
  capture.result.findings = {MakeFinding("warning", Severity::kWarning, 0, 1),
                             MakeFinding("cause", Severity::kInfo, 0, 5),
                             MakeFinding("consequence", Severity::kError, 0, 6, 1),
                             MakeFinding("consequence of that", Severity::kWarning, 0, 7, 2)};
  EXPECT_EQ(Order(capture), (Pairs{{1, 0}, {2, 1}, {3, 2}, {0, 0}}));
}

TEST(FindingOrder, WhatHappenedFirstComesFirstWhereItsCauseShowsLater) {
  // A refusal whose AL status code, and with it the cause, is read thousands of frames behind it.
  CaptureReport capture;
  capture.result.findings = {
      MakeFinding("unrelated", Severity::kError, 0, 50), MakeFinding("cause", Severity::kWarning, 0, 100),
      MakeFinding("refusal", Severity::kError, 0, 10, 1), MakeFinding("later", Severity::kWarning, 0, 101, 2)};
  EXPECT_EQ(Order(capture), (Pairs{{1, 0}, {2, 1}, {3, 2}, {0, 0}}));
}

TEST(FindingOrder, KnownFindingsAreLeftOutAndTheirConsequencesStandAlone) {
  CaptureReport capture;
  capture.result.findings = {MakeFinding("cause", Severity::kError, 0, 1),
                             MakeFinding("consequence", Severity::kError, 0, 2, 0)};
  capture.known = {true, false};
  EXPECT_EQ(Order(capture), (Pairs{{1, 0}}));
}

TEST(FindingOrder, ACircleOfCausesLosesNothing) {
  CaptureReport capture;
  capture.result.findings = {MakeFinding("a", Severity::kError, 0, 1, 1), MakeFinding("b", Severity::kError, 0, 2, 0),
                             MakeFinding("self", Severity::kError, 0, 3, 2),
                             MakeFinding("nowhere", Severity::kError, 0, 4, 99)};
  EXPECT_EQ(OrderForReading(capture).size(), 4U);
}

}  // namespace
}  // namespace ecaudit::report
