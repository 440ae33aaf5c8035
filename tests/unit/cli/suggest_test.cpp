#include "cli/suggest.h"

#include <array>

#include <gtest/gtest.h>

namespace ecaudit::cli {
namespace {

constexpr std::array<std::string_view, 4> kNames{"check", "rules", "explain", "kollmorgen-akd-2011"};

TEST(Suggest, NearNames) {
  EXPECT_EQ(Nearest("chek", kNames), "check");
  EXPECT_EQ(Nearest("rule", kNames), "rules");
  EXPECT_EQ(Nearest("kollmorgen-akd-211", kNames), "kollmorgen-akd-2011");
  EXPECT_EQ(Nearest("kollmorgen", kNames), "kollmorgen-akd-2011") << "a beginning";
}

TEST(Suggest, NothingNear) {
  EXPECT_EQ(Nearest("foo", kNames), "");
  EXPECT_EQ(Nearest("", kNames), "");
  EXPECT_EQ(Nearest(std::string(100'000, 'a'), kNames), "");
}

TEST(Suggest, Wording) {
  EXPECT_EQ(Suggestion("chek", kNames, "ecaudit --help"), " (did you mean 'check'?)");
  EXPECT_EQ(Suggestion("foo", kNames, "ecaudit --help"), " (see 'ecaudit --help')");
  EXPECT_EQ(Suggestion("foo", kNames, ""), "");
}

TEST(Suggest, PartOfSeveralNames) {
  constexpr std::array<std::string_view, 3> kFamilies{"akd-2010", "akd-2011", "mkd-c"};
  EXPECT_EQ(Suggestion("AKD", kFamilies, "ecaudit profiles"), " (did you mean 'akd-2010' or 'akd-2011'?)");
  EXPECT_EQ(Suggestion("kd", kFamilies, "ecaudit profiles"), " (see 'ecaudit profiles')") << "two letters are in all";
}

}  // namespace
}  // namespace ecaudit::cli
