/// Law: every rule ends every capture in exactly one way for each slave, and what was not judged says why.
#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/result/every_slave.h"
#include "decoder/capture/capture_reader.h"
#include "tests/property/captures.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using test::CapturesIn;

AnalysisResult AnalyseCapture(const fs::path& path, const AnalysisOptions& options) {
  auto source = capture::OpenCapture(path.string());
  return source ? Analyse(**source, options) : AnalysisResult{};
}

/// A line that covers the slave; for the bus, a line about any part of it.
bool IsSaid(const AnalysisResult& result, std::string_view rule, SlaveId slave) {
  return std::any_of(result.not_evaluable.begin(), result.not_evaluable.end(), [&](const NotEvaluable& entry) {
    return entry.rule == rule &&
           (slave == kNoSlave || entry.slave == slave || entry.slave == kNoSlave || entry.slave == kEverySlave);
  });
}

void CheckCoverage(const AnalysisResult& result, const AnalysisOptions& options) {
  ASSERT_EQ(result.coverage.size(), RuleCatalogue().size());
  for (std::size_t i = 0; i < result.coverage.size(); ++i) {
    const RuleCoverage& rule = result.coverage[i];
    EXPECT_EQ(rule.rule, RuleCatalogue()[i]->id);
    EXPECT_EQ(rule.chapter, RuleCatalogue()[i]->group);
    std::set<SlaveId> slaves;
    for (const SlaveCoverage& entry : rule.slaves) {
      EXPECT_TRUE(slaves.insert(entry.slave).second) << rule.rule << ": twice for slave " << entry.slave;
      const std::string where = std::string(rule.rule) + ", slave " + std::to_string(entry.slave);
      const bool open = entry.coverage == Coverage::kNotJudged || entry.coverage == Coverage::kPartly;
      if (entry.coverage != Coverage::kNotApplicable) {
        EXPECT_EQ(IsSaid(result, rule.rule, entry.slave), open) << where;
      }
      EXPECT_EQ(entry.coverage == Coverage::kNotApplicable, !Describe(entry.why).empty()) << where;
    }
    if (slaves.contains(kNoSlave)) {
      EXPECT_EQ(slaves.size(), 1U) << rule.rule;
    } else {
      EXPECT_EQ(slaves.size(), result.slaves.size()) << rule.rule;
    }
    EXPECT_FALSE(slaves.empty()) << rule.rule;
    // A finding is something that was judged.
    for (const Finding& finding : result.findings) {
      if (finding.rule != rule.rule) continue;
      const auto at = std::find_if(rule.slaves.begin(), rule.slaves.end(), [&](const SlaveCoverage& entry) {
        return entry.slave == finding.slave || entry.slave == kNoSlave;
      });
      if (at == rule.slaves.end()) continue;
      EXPECT_TRUE(at->coverage == Coverage::kJudged || at->coverage == Coverage::kPartly) << rule.rule;
    }
    const auto setting = options.rules.find(rule.rule);
    if (setting == options.rules.end() || !setting->second.off) continue;
    // Where it would not apply, that counts more.
    for (const SlaveCoverage& entry : rule.slaves) {
      EXPECT_EQ(entry.coverage, Coverage::kNotApplicable);
      EXPECT_TRUE(entry.why == NotApplicable::kSwitchedOff || entry.why == NotApplicable::kNoRequest) << rule.rule;
    }
  }
}

void CheckFolder(const fs::path& folder, std::size_t every) {
  const std::vector<fs::path> captures = CapturesIn(folder);
  for (std::size_t i = 0; i < captures.size(); ++i) {
    SCOPED_TRACE(captures[i].filename().string());
    const AnalysisResult whole = AnalyseCapture(captures[i], {});
    CheckCoverage(whole, {});
    if (i % every != 0) continue;
    AnalysisOptions second_half;
    second_half.from_frame = whole.capture.packets / 2;
    second_half.rules["al-refused"].off = true;
    CheckCoverage(AnalyseCapture(captures[i], second_half), second_half);
  }
}

TEST(Coverage, EachRuleEndsInOneWayInSamples) {
  const fs::path folder = fs::path(test::SourceDir()) / "samples" / "captures";
  ASSERT_FALSE(CapturesIn(folder).empty());
  CheckFolder(folder, 1);
}

TEST(Coverage, EachRuleEndsInOneWayInRealCaptures) {
  const fs::path folder = fs::path(test::SharedDir()) / "captures" / "real";
  if (!fs::exists(folder)) GTEST_SKIP() << "the real captures are not beside the project";
  CheckFolder(folder, 1);
}

TEST(Coverage, EachRuleEndsInOneWayInLabCaptures) {
  const fs::path folder = fs::path(test::SharedDir()) / "captures" / "lab";
  if (!fs::exists(folder)) GTEST_SKIP() << "the lab captures are not beside the project";
  CheckFolder(folder, 4);
}

}  // namespace
}  // namespace ecaudit
