#include "cli/report/progress_text.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

constexpr Word kAnswers{"answers", "answers"};
constexpr Word kOp{"op", "OP"};
constexpr Word kEnabled{"enabled", "enabled"};
constexpr Word kNoStatusWord{"no-status-word", "the status word is not in the capture"};

/// The line of one slave in OP whose only axis has this rung.
std::string LineWith(const Rung& enabled) {
  AnalysisResult result;
  SlaveSummary slave = test::MakeSlave(0, 0, 0x1001, "");
  slave.progress.rungs = {{.rung = &kAnswers, .status = RungStatus::kReached},
                          {.rung = &kOp, .status = RungStatus::kReached}};
  slave.axes.push_back({0, {{enabled}}});
  result.slaves.push_back(std::move(slave));
  const std::vector<ProgressLine> lines = ProgressLines(result);
  return lines.size() == 1 ? lines[0].text : "";
}

TEST(ProgressText, AnAxisIsTheSubjectUnlessItsTextHasOne) {
  EXPECT_EQ(LineWith({.rung = &kEnabled, .status = RungStatus::kUnknown, .why = &kNoStatusWord}),
            "OP; drive: the status word is not in the capture");
  EXPECT_EQ(LineWith({.rung = &kEnabled, .status = RungStatus::kUnknown}),
            "OP; drive: the state is not in the capture");
  EXPECT_EQ(LineWith({.rung = &kEnabled, .status = RungStatus::kNotAsked}),
            "OP; drive not enabled; the master does not ask for it");
}

}  // namespace
}  // namespace ecaudit::report
