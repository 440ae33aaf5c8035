#include "cli/stream/columns.h"

#include <gtest/gtest.h>

namespace ecaudit::cli {
namespace {

TEST(Columns, PadsLeftAndRightAndTrimsTheEnd) {
  std::string out;
  Columns(out, false).Right("7", 3).Left("ab", 4).Last("end");
  EXPECT_EQ(out, "  7  ab    end");
  out.clear();
  Columns(out, false).Left("ab", 4).Last("");
  EXPECT_EQ(out, "ab");
}

TEST(Columns, WideTextPushesTheRest) {
  std::string out;
  Columns(out, false).Right("12345", 3).Last("x");
  EXPECT_EQ(out, "12345  x");
}

TEST(Columns, CountsCharactersNotBytes) {
  std::string out;
  Columns(out, false).Left("\xC3\xA4", 3).Last("x");
  EXPECT_EQ(out, "\xC3\xA4    x");
}

TEST(Columns, ColourDoesNotMoveColumns) {
  std::string out;
  Columns(out, true).Right("7", 3, report::Style::kError).Last("x", report::Style::kPlain);
  EXPECT_EQ(out.substr(0, 2), "  ");
  EXPECT_NE(out.find("\x1b["), std::string::npos);
  EXPECT_EQ(out.substr(out.size() - 3), "  x");
}

TEST(Columns, Seconds) {
  EXPECT_EQ(SecondsText(1'500'000'000), "1.500000000");
  EXPECT_EQ(SecondsText(std::nullopt), "-");
}

}  // namespace
}  // namespace ecaudit::cli
