#include "cli/output_file.h"

#include <array>
#include <filesystem>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "tests/unit/cli/temp_dir.h"

namespace ecaudit::cli {
namespace {

using test::TempDir;
namespace fs = std::filesystem;

/// A pcap of one empty capture: header only, microseconds, Ethernet.
std::string EmptyPcap() {
  constexpr std::array<unsigned char, 24> kHeader{0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0,
                                                  0,    0,    0,    0,    0, 0, 4, 0, 1, 0, 0, 0};
  return {kHeader.begin(), kHeader.end()};
}

TEST(OutputFile, WritesAndReplacesItsOwnEarlierReport) {
  const TempDir dir;
  const std::string path = dir.Path("report.json");
  EXPECT_FALSE(CheckOutputPath(path));
  EXPECT_FALSE(WriteOutputFile(path, "first, longer"));
  EXPECT_FALSE(CheckOutputPath(path));
  EXPECT_FALSE(WriteOutputFile(path, "second"));
  EXPECT_EQ(TempDir::Read(path), "second");
  EXPECT_EQ(dir.Entries(), 1U) << "no temporary file is left";
}

TEST(OutputFile, NeverOverACapture) {
  const TempDir dir;
  const auto pcap = CheckOutputPath(dir.Write("a.json", EmptyPcap()));
  ASSERT_TRUE(pcap);
  EXPECT_NE(pcap->message.find("is a capture and will not be overwritten"), std::string::npos);
  EXPECT_TRUE(CheckOutputPath(dir.Write("b.json", std::string_view("\x0a\x0d\x0d\x0a", 4)))) << "pcapng";
}

TEST(OutputFile, FoldersAndMissingFolders) {
  const TempDir dir;
  EXPECT_TRUE(CheckOutputPath(dir.Path("")));
  const auto missing = CheckOutputPath(dir.Path("no/report.json"));
  ASSERT_TRUE(missing);
  EXPECT_EQ(missing->message,
            "cannot write " + dir.Path("no/report.json") + ": there is no directory " + dir.Path("no"));
}

TEST(OutputFile, FollowsLinksAndKeepsPermissions) {
  const TempDir dir;
  const std::string target = dir.Write("target", "old");
  chmod(target.c_str(), 0640);
  fs::create_symlink(target, dir.Path("link"));
  EXPECT_FALSE(WriteOutputFile(dir.Path("link"), "new"));
  EXPECT_TRUE(fs::is_symlink(dir.Path("link")));
  EXPECT_EQ(TempDir::Read(target), "new");
  EXPECT_EQ(fs::status(target).permissions(), static_cast<fs::perms>(0640));
}

TEST(OutputFile, FullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const auto error = WriteOutputFile("/dev/full", "text");
  ASSERT_TRUE(error);
  EXPECT_EQ(error->message, "cannot write /dev/full: No space left on device");
}

TEST(OutputFile, PieceByPiece) {
  const TempDir dir;
  const std::string path = dir.Write("lines", "old");
  {
    Result<OutputFile> file = OutputFile::Create(path);
    ASSERT_TRUE(file.has_value());
    EXPECT_FALSE(file->Write("one\n"));
    EXPECT_EQ(TempDir::Read(path), "old") << "readers see the old file until the new one is whole";
    EXPECT_FALSE(file->Write("two\n"));
    EXPECT_FALSE(file->Finish());
  }
  EXPECT_EQ(TempDir::Read(path), "one\ntwo\n");
  EXPECT_EQ(dir.Entries(), 1U);
}

TEST(OutputFile, AnUnfinishedFileIsTakenAway) {
  const TempDir dir;
  {
    Result<OutputFile> file = OutputFile::Create(dir.Path("new"));
    ASSERT_TRUE(file.has_value());
    EXPECT_FALSE(file->Write("half"));
    OutputFile moved = std::move(*file);
    EXPECT_FALSE(moved.Write("more"));
  }
  EXPECT_EQ(dir.Entries(), 0U);
}

}  // namespace
}  // namespace ecaudit::cli
