#include "cli/slave_filter.h"

#include <array>

#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::cli {
namespace {

using test::MakeFinding;
using test::MakeSlave;

AnalysisResult ThreeSlaves() {
  AnalysisResult result;
  result.slaves = {MakeSlave(10, 0, 0x1001, "a"), MakeSlave(11, 1, 0x1002, "b"), MakeSlave(12, 2, 0x1003, "c")};
  result.findings = {MakeFinding("bus", Severity::kError, kNoSlave, 1), MakeFinding("of-a", Severity::kError, 10, 2),
                     MakeFinding("of-b", Severity::kError, 11, 3), MakeFinding("of-c", Severity::kError, 12, 4, 2)};
  result.coverage = {{"r", "c", {{10, {}, {}}, {11, {}, {}}}}, {"b", "c", {{kNoSlave, {}, {}}}}};
  result.not_evaluable = {{"r", 10, test::Because("why"), 0, 1},
                          {"r", 11, test::Because("why"), 0, 1},
                          {"r", kNoSlave, test::Because("why"), 0, 1}};
  return result;
}

TEST(SlaveFilter, KeepsTheSlaveAndTheBus) {
  AnalysisResult result = ThreeSlaves();
  const std::array selectors{SlaveSelector{false, 0}};
  EXPECT_EQ(KeepSlaves(selectors, result), 1U);
  ASSERT_EQ(result.findings.size(), 2U);
  EXPECT_EQ(result.findings[0].rule, "bus");
  EXPECT_EQ(result.findings[1].rule, "of-a");
  ASSERT_EQ(result.slaves.size(), 1U);
  EXPECT_EQ(result.slaves[0].id, 10);
  EXPECT_EQ(result.not_evaluable.size(), 2U);
  EXPECT_EQ(result.coverage[0].slaves.size(), 1U);
  EXPECT_EQ(result.coverage[1].slaves.size(), 1U) << "of the bus";
}

TEST(SlaveFilter, KeepsCausesAndTheirSlaves) {
  AnalysisResult result = ThreeSlaves();
  const std::array selectors{SlaveSelector{true, 0x1003}};
  EXPECT_EQ(KeepSlaves(selectors, result), 1U);
  ASSERT_EQ(result.findings.size(), 3U);
  EXPECT_EQ(result.findings[1].rule, "of-b");
  EXPECT_EQ(result.findings[2].rule, "of-c");
  EXPECT_EQ(result.findings[2].caused_by, 1U) << "points to the cause's new place";
  EXPECT_EQ(result.slaves.size(), 2U);
}

TEST(SlaveFilter, NoSelectorKeepsAll) {
  AnalysisResult result = ThreeSlaves();
  EXPECT_EQ(KeepSlaves({}, result), 3U);
  EXPECT_EQ(result.findings.size(), 4U);
}

TEST(SlaveFilter, UnknownSlave) {
  AnalysisResult result = ThreeSlaves();
  const std::array selectors{SlaveSelector{false, 9}};
  EXPECT_EQ(KeepSlaves(selectors, result), 0U);
}

}  // namespace
}  // namespace ecaudit::cli
