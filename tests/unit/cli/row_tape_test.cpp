#include "cli/stream/row_tape.h"

#include <cstdlib>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace ecaudit::cli {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();

/// Writes so many rows of all kinds of values and reads them back.
void ExpectBack(RowTape& tape, std::size_t rows) {
  for (std::size_t i = 0; i < rows; ++i) {
    tape.PutNumber(i);
    tape.PutSigned(-static_cast<std::int64_t>(i));
    const std::vector<std::uint8_t> bytes(i % 300, static_cast<std::uint8_t>(i));
    tape.PutNumber(bytes.size());
    tape.Put(bytes);
    tape.PutNumber(kMost - i);
    tape.PutSigned(kLeast);
    tape.EndRow();
  }
  tape.Rewind();
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < rows; ++i) {
    ASSERT_TRUE(tape.more()) << i;
    ASSERT_EQ(tape.TakeNumber(), i);
    ASSERT_EQ(tape.TakeSigned(), -static_cast<std::int64_t>(i));
    tape.Take(bytes, tape.TakeNumber());
    ASSERT_EQ(bytes, std::vector<std::uint8_t>(i % 300, static_cast<std::uint8_t>(i)));
    ASSERT_EQ(tape.TakeNumber(), kMost - i);
    ASSERT_EQ(tape.TakeSigned(), kLeast);
  }
  EXPECT_FALSE(tape.more());
  EXPECT_FALSE(tape.failed());
}

TEST(RowTape, FewRowsStayInMemory) {
  ASSERT_EQ(::setenv("TMPDIR", "/nonexistent", 1), 0);
  RowTape tape;
  ExpectBack(tape, 0);
  tape.Clear();
  ExpectBack(tape, 200);
  ::unsetenv("TMPDIR");
}

TEST(RowTape, ManyRowsLieInAFile) {
  RowTape tape;
  ExpectBack(tape, 20'000);
  tape.Clear();
  ExpectBack(tape, 3);
}

TEST(RowTape, ReportsThatThereCanBeNoFile) {
  ASSERT_EQ(::setenv("TMPDIR", "/nonexistent", 1), 0);
  RowTape tape;
  for (int i = 0; i < 100'000; ++i) {
    tape.PutNumber(kMost);
    tape.EndRow();
  }
  ::unsetenv("TMPDIR");
  EXPECT_TRUE(tape.failed());
  tape.Rewind();
  EXPECT_FALSE(tape.more());
}

}  // namespace
}  // namespace ecaudit::cli
