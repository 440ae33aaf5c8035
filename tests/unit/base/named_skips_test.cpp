#include "tests/support/named_skips.h"

#include <gtest/gtest.h>

namespace ecaudit::test {
namespace {

[[maybe_unused]] const bool kNamed = ExpectNamedSkips("unit");

TEST(NamedSkips, LinesAreRead) {
  const auto needs = ParseNeeds("# why\n\nshared unit.Lab.Works  # all\ntshark cli.Shark.*\n");
  ASSERT_TRUE(needs) << needs.error().message;
  ASSERT_EQ(needs->size(), 2U);
  EXPECT_EQ((*needs)[0].what, "shared");
  EXPECT_EQ((*needs)[0].test, "unit.Lab.Works");
  EXPECT_EQ((*needs)[1].test, "cli.Shark.*");
  for (const char* line : {"\nshared", "\nshared unit.Lab.Works more", "\nshared Lab.Works"}) {
    const auto bad = ParseNeeds(line);
    ASSERT_FALSE(bad) << line;
    EXPECT_EQ(bad.error().message, "line 2: a line is NEED PROGRAM.SUITE.NAME");
  }
}

TEST(NamedSkips, AStarStandsForAnything) {
  EXPECT_TRUE(MatchesPattern("a.b*", "a.b"));
  EXPECT_TRUE(MatchesPattern("*/a.*.c", "x/a.b.c"));
  EXPECT_FALSE(MatchesPattern("a.b", "a.bc"));
  EXPECT_FALSE(MatchesPattern("*.b", "a.bc"));
  EXPECT_FALSE(MatchesPattern("b*", "a.b"));
}

TEST(NamedSkips, OnlyWhatIsNamedMaySkip) {
  const std::vector<Need> needs = {{"shared", "unit.Lab.*"}, {"tshark", "unit.Lab.Compares"}};
  EXPECT_EQ(ProblemOfSkip("unit.Lab.Works", needs, false), "");
  EXPECT_NE(ProblemOfSkip("unit.Lab.Works", needs, true), "") << "what it needs is there";
  EXPECT_EQ(ProblemOfSkip("unit.Lab.Compares", needs, true), "") << "tshark may be what it lacks";
  EXPECT_NE(ProblemOfSkip("unit.Other.Works", needs, false), "");
}

}  // namespace
}  // namespace ecaudit::test
