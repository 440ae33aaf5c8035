#include "tests/support/named_skips.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/folders.h"

namespace ecaudit::test {
namespace {

std::string& Program() {
  static std::string program;
  return program;
}

/// The lines of tests/needs.txt, read once.
const Result<std::vector<Need>>& AllNeeds() {
  static const Result<std::vector<Need>> needs = [] {
    std::ostringstream text;
    text << std::ifstream(SourceDir() + "/tests/needs.txt").rdbuf();
    return ParseNeeds(text.str());
  }();
  return needs;
}

std::string NameOf(const ::testing::TestInfo& test) {
  return Program() + "." + test.test_suite_name() + "." + test.name();
}

class SkipListener final : public ::testing::EmptyTestEventListener {
  void OnTestEnd(const ::testing::TestInfo& test) override {
    if (!test.result()->Skipped() || !AllNeeds()) return;
    const std::string problem = ProblemOfSkip(NameOf(test), *AllNeeds(), std::filesystem::exists(SharedDir()));
    if (!problem.empty()) ADD_FAILURE() << problem;
  }
};

}  // namespace

Result<std::vector<Need>> ParseNeeds(std::string_view text) {
  std::vector<Need> needs;
  std::istringstream stream{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    Need need;
    std::string more;
    if (!(words >> need.what)) continue;
    if (!(words >> need.test) || words >> more || std::count(need.test.begin(), need.test.end(), '.') < 2) {
      return Error{"line " + std::to_string(number) + ": a line is NEED PROGRAM.SUITE.NAME"};
    }
    needs.push_back(std::move(need));
  }
  return needs;
}

bool MatchesPattern(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name;
  if (!name.starts_with(pattern.substr(0, star))) return false;
  for (std::size_t from = star; from <= name.size(); ++from) {
    if (MatchesPattern(pattern.substr(star + 1), name.substr(from))) return true;
  }
  return false;
}

std::string ProblemOfSkip(std::string_view test, const std::vector<Need>& needs, bool shared) {
  bool named = false;
  for (const Need& need : needs) {
    if (!MatchesPattern(need.test, test)) continue;
    if (need.what != "shared" || !shared) return "";
    named = true;
  }
  if (named) return std::string(test) + " skips although " + SharedDir() + " is there";
  return std::string(test) + " skips, and tests/needs.txt does not state what it needs";
}

bool ExpectNamedSkips(std::string program) {
  Program() = std::move(program);
  ::testing::UnitTest::GetInstance()->listeners().Append(new SkipListener);
  return true;
}

TEST(NamedSkips, EachLineNamesATestOfThisProgram) {
  ASSERT_TRUE(AllNeeds()) << "tests/needs.txt: " << AllNeeds().error().message;
  const ::testing::UnitTest& all = *::testing::UnitTest::GetInstance();
  for (const Need& need : *AllNeeds()) {
    if (!need.test.starts_with(Program() + ".")) continue;
    bool found = false;
    for (int i = 0; i < all.total_test_suite_count() && !found; ++i) {
      const ::testing::TestSuite& suite = *all.GetTestSuite(i);
      for (int k = 0; k < suite.total_test_count() && !found; ++k) {
        found = MatchesPattern(need.test, NameOf(*suite.GetTestInfo(k)));
      }
    }
    EXPECT_TRUE(found) << "tests/needs.txt: no test is called " << need.test;
  }
}

}  // namespace ecaudit::test
