#include "decoder/base/regular_file.h"

#include <sys/stat.h>

#include <gtest/gtest.h>

#include "tests/unit/cli/temp_dir.h"

namespace ecaudit {
namespace {

using Outcome = FileContent::Outcome;
using test::TempDir;

TEST(RegularFile, IsReadWhole) {
  const TempDir dir;
  const std::string path = dir.Write("a", std::string(200'000, 'x'));
  const FileContent content = ReadRegularFile(path, 200'000);
  EXPECT_EQ(content.outcome, Outcome::kRead);
  EXPECT_EQ(content.text, std::string(200'000, 'x'));
  EXPECT_EQ(ReadRegularFile(dir.Write("empty", ""), 10).outcome, Outcome::kRead);
}

TEST(RegularFile, NoMoreThanAllowed) {
  const TempDir dir;
  const FileContent content = ReadRegularFile(dir.Write("a", "12345"), 4);
  EXPECT_EQ(content.outcome, Outcome::kTooLarge);
  EXPECT_TRUE(content.text.empty());
}

TEST(RegularFile, NothingElseIsWaitedFor) {
  const TempDir dir;
  ASSERT_EQ(mkfifo(dir.Path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(ReadRegularFile(dir.Path("pipe"), 100).outcome, Outcome::kOtherKind);
  EXPECT_EQ(ReadRegularFile("/dev/zero", 100).outcome, Outcome::kOtherKind);
  EXPECT_EQ(ReadRegularFile(dir.Path("."), 100).outcome, Outcome::kFolder);
  EXPECT_EQ(ReadRegularFile(dir.Path("nowhere"), 100).outcome, Outcome::kMissing);
}

}  // namespace
}  // namespace ecaudit
