/// Law: rules may receive events and finish in any order that RuleInfo::after allows. No report depends on it.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/judge/rule.h"
#include "cli/report/json_writer.h"
#include "cli/report/report.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/capture/frame_source.h"
#include "tests/property/captures.h"
#include "tests/support/folders.h"
#include "tests/support/trace_file.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

std::string ReportOn(capture::FrameSource& source, std::uint32_t shuffle, const std::string& profile = {}) {
  AnalysisOptions options;
  options.shuffle_rules = shuffle;
  options.default_profile = profile;
  report::Report report;
  report.captures.emplace_back().result = Analyse(source, options);
  return report::WriteJson(report);
}

/// @param report  report(shuffle): the whole report with the rules in that order
template <class ReportInOrder>
void ExpectNoOrderMatters(const fs::path& path, ReportInOrder report) {
  const std::string by_id = report(0U);
  for (const std::uint32_t shuffle : {1U, 2U, 3U}) {
    const std::string shuffled = report(shuffle);
    if (by_id == shuffled) continue;
    const auto at = std::mismatch(by_id.begin(), by_id.end(), shuffled.begin(), shuffled.end()).first;
    const auto where = static_cast<std::size_t>(at - by_id.begin());
    const std::size_t from = where - std::min<std::size_t>(where, 400);
    ADD_FAILURE() << path << ", order " << shuffle << ": by id\n"
                  << by_id.substr(from, 700) << "\nshuffled\n"
                  << shuffled.substr(std::min(from, shuffled.size()), 700);
  }
}

TEST(RuleOrder, ChangesNoReportOfASample) {
  for (const fs::path& path : test::CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures")) {
    ExpectNoOrderMatters(path, [&](std::uint32_t shuffle) {
      auto source = capture::OpenCapture(path.string());
      return source ? ReportOn(**source, shuffle) : source.error().message;
    });
  }
}

TEST(RuleOrder, ChangesNoReportOfATrace) {
  std::size_t traces = 0;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(test::SourceDir()) / "tests" / "rules")) {
    if (entry.path().extension() != ".trace" || entry.path().parent_path().filename() == "common") continue;
    const auto trace = test::Trace::Load(entry.path().string());
    ASSERT_TRUE(trace) << trace.error().message;
    const auto profile = trace->attributes().find("profile");
    ++traces;
    ExpectNoOrderMatters(entry.path(), [&](std::uint32_t shuffle) {
      return ReportOn(*trace->Source(), shuffle,
                      profile == trace->attributes().end() ? std::string() : profile->second);
    });
  }
  EXPECT_GT(traces, RuleCatalogue().size());
}

TEST(RuleOrder, FollowsWhatRulesDeclare) {
  for (const std::uint32_t shuffle : {0U, 1U, 2U, 3U}) {
    const auto rules = MakeAllRules(shuffle);
    ASSERT_EQ(rules.size(), RuleCatalogue().size());
    for (std::size_t i = 0; i < rules.size(); ++i) {
      for (const std::string_view earlier : rules[i]->info().after) {
        EXPECT_NE(FindRule(earlier), nullptr) << rules[i]->info().id << " waits for " << earlier;
        const auto end = rules.begin() + static_cast<std::ptrdiff_t>(i);
        EXPECT_TRUE(std::any_of(rules.begin(), end, [&](const auto& rule) { return rule->info().id == earlier; }))
            << rules[i]->info().id << " has to come after " << earlier << ": do they wait for each other?";
      }
    }
  }
}

}  // namespace
}  // namespace ecaudit
