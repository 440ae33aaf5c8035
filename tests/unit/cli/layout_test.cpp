#include "cli/report/layout.h"

#include <gtest/gtest.h>

namespace ecaudit::report {
namespace {

TEST(Layout, ParagraphBreaksAtSpaces) {
  TextBuilder text(false);
  text.Paragraph(std::string(60, 'a') + " " + std::string(60, 'b') + " c", 2, 4);
  EXPECT_EQ(text.Take(), "  " + std::string(60, 'a') + "\n    " + std::string(60, 'b') + " c\n");
}

TEST(Layout, LongWordsStayWhole) {
  TextBuilder text(false);
  text.Paragraph(std::string(300, 'a') + " b", 0);
  EXPECT_EQ(text.Take(), std::string(300, 'a') + "\nb\n");
}

TEST(Layout, HardSpacesDoNotBreak) {
  TextBuilder text(false);
  text.Paragraph(std::string(100, 'a') + " bb" + kHardSpace + "cccccccccc", 0);
  EXPECT_EQ(text.Take(), std::string(100, 'a') + "\nbb cccccccccc\n");
}

TEST(Layout, SpacesAreJoined) {
  TextBuilder text(false);
  text.Paragraph("  a   b ", 1);
  EXPECT_EQ(text.Take(), " a b\n");
}

TEST(Layout, FieldStandsBesideItsLabel) {
  TextBuilder text(false);
  text.Field("source", std::string(90, 'x') + " yy", 4);
  EXPECT_EQ(text.Take(), "    source     " + std::string(90, 'x') + " yy\n");
  text.Field("empty", "", 4);
  EXPECT_EQ(text.Take(), "");
}

TEST(Layout, UmlautsTakeOneColumn) {
  EXPECT_EQ(Columns("\xC3\xA4rger"), 5U);
}

TEST(Layout, ColumnsOfTheTerminal) {
  EXPECT_EQ(Columns("\xE8\xBB\xB8 1"), 4U) << "two columns for a character of East Asia";
  EXPECT_EQ(Columns("a\xCC\x88"), 1U) << "none for what combines";
  EXPECT_EQ(Columns("\xFF\xC3"), 2U) << "broken UTF-8 is as wide as its bytes";
}

TEST(Layout, LinesAreAsWideAsTheTerminal) {
  TextStyle narrow;
  narrow.width = 20;
  TextBuilder text(narrow);
  text.Paragraph("0123456789 0123456789 0", 0, 2);
  EXPECT_EQ(text.Take(), "0123456789\n  0123456789 0\n");
}

TEST(Layout, CutToColumns) {
  EXPECT_EQ(CutToColumns("short", 5), "short");
  EXPECT_EQ(CutToColumns("one two three four", 13), "one two ...");
  EXPECT_EQ(CutToColumns(std::string(40, 'x'), 10), "xxxxxx ...");
  EXPECT_EQ(CutToColumns("state, and more", 11), "state ...");
}

TEST(Layout, OneLineHasNoLineBreaks) {
  EXPECT_EQ(OneLine("a\r\n\tb\x1b"), "a   b\\x1b");
}

TEST(Layout, NoEscapesWithoutColour) {
  EXPECT_EQ(TextBuilder(false).Styled("x", Style::kError), "x");
  EXPECT_EQ(TextBuilder(true).Styled("x", Style::kBold), "\x1b[1mx\x1b[0m");
}

}  // namespace
}  // namespace ecaudit::report
