#include "tests/support/csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::test {
namespace {

using ::testing::ElementsAre;

TEST(Csv, SplitsCellsAndKeepsEmptyOnes) {
  EXPECT_THAT(ParseCsvCells("a,b,c\n1,,3\n"), ElementsAre(ElementsAre("a", "b", "c"), ElementsAre("1", "", "3")));
}

TEST(Csv, QuotedCellsMayHoldCommasQuotesAndLineBreaks) {
  EXPECT_THAT(ParseCsvCells("\"a,b\",\"say \"\"x\"\"\",\"two\nlines\""),
              ElementsAre(ElementsAre("a,b", "say \"x\"", "two\nlines")));
}

TEST(Csv, RowsAreReadByColumnName) {
  const auto rows = ParseCsv("family,code\r\nakd_b,0x0011\r\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].at("family"), "akd_b");
  EXPECT_EQ(rows[0].at("code"), "0x0011");
}

}  // namespace
}  // namespace ecaudit::test
