#include <array>
#include <cstdlib>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "decoder/base/system/files.h"
#include "decoder/base/system/locks.h"
#include "decoder/base/system/names.h"
#include "decoder/base/system/process.h"
#include "decoder/base/system/signals.h"
#include "tests/unit/cli/temp_dir.h"

namespace ecaudit::system {
namespace {

using test::TempDir;

TEST(SystemNames, NameOfAPath) {
  EXPECT_EQ(NameOf("a/b.pcap"), "b.pcap");
  EXPECT_EQ(NameOf("b.pcap"), "b.pcap");
  EXPECT_EQ(NameOf("a/"), "");
}

TEST(SystemNames, Patterns) {
  EXPECT_TRUE(MatchesPattern("axis12.pcapng", "axis*.pcap*"));
  EXPECT_TRUE(MatchesPattern("axis1.pcap", "axis[0-3].pca?"));
  EXPECT_FALSE(MatchesPattern("axis4.pcap", "axis[!4].pcap"));
  EXPECT_FALSE(MatchesPattern("axis1.pcapng", "axis*.pcap"));
}

TEST(SystemNames, PathsAreSortedAndHiddenOnesLeftOut) {
  const TempDir dir;
  dir.Write("b.pcap", "");
  dir.Write("a.pcap", "");
  dir.Write(".c.pcap", "");
  EXPECT_EQ(PathsMatching(dir.Path("*.pcap")), (std::vector{dir.Path("a.pcap"), dir.Path("b.pcap")}));
  EXPECT_TRUE(PathsMatching(dir.Path("*.pcapng")).empty());
}

TEST(SystemFiles, ANamelessFileCanBeReadByItsPath) {
  const Nameless file = MakeNameless();
  ASSERT_GE(file.fd, 0);
  ASSERT_TRUE(WriteAll(file.fd, "text"));
  const int again = OpenToRead(file.path);
  ASSERT_GE(again, 0);
  ASSERT_TRUE(Rewind(again));
  std::array<std::uint8_t, 10> bytes{};
  EXPECT_EQ(Read(again, bytes), 4);
  EXPECT_TRUE(Close(again));
  EXPECT_TRUE(Close(file.fd));
}

TEST(SystemFiles, TwoNamesOfAFileAreOneNode) {
  const TempDir dir;
  const std::string path = dir.Write("a", "123");
  const std::optional<FileStatus> one = StatusOf(path);
  const std::optional<FileStatus> two = StatusOf(dir.Path("./a"));
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->node, two->node);
  EXPECT_EQ(one->bytes, 3U);
  EXPECT_FALSE(StatusOf(dir.Path("nowhere")));
}

TEST(SystemLocks, OneHolderIsAlone) {
  const TempDir dir;
  FolderHold first(dir.Path("."));
  FolderHold second(dir.Path("."));
  EXPECT_EQ(first.TryAlone(), FolderHold::Outcome::kAlone);
  EXPECT_EQ(second.TryAlone(), FolderHold::Outcome::kOthers);
  first.Share();
  EXPECT_EQ(second.TryAlone(), FolderHold::Outcome::kOthers);
}

/// Answers each byte with the one after it; ends by a signal on 'x', with status 7 on 'y'.
void Serve(ParentLink& parent) {
  LeaveCrashesAlone();
  std::array<char, 1> byte{};
  while (parent.Read(byte)) {
    if (byte[0] == 'x') std::abort();
    if (byte[0] == 'y') EndAtOnce(7);
    *static_cast<char*>(parent.shared()) = byte[0];
    ++byte[0];
    if (!parent.Write({byte.data(), 1})) break;
  }
  EndAtOnce(0);
}

std::string Received(Worker& worker) {
  constexpr int kLongMs = 20'000;
  WorkerWait wait;
  wait.Add(worker);
  std::array<char, 10> bytes{};
  if (!wait.Wait(kLongMs) || !wait.Has(0)) return "nothing came";
  const std::optional<std::size_t> got = worker.Read(bytes);
  return got ? std::string(bytes.data(), *got) : "it has ended";
}

TEST(SystemWorker, AnswersAndSharesMemory) {
  Worker worker;
  ASSERT_FALSE(worker.Start(1, "", Serve));
  ASSERT_TRUE(worker.Write("a"));
  EXPECT_EQ(Received(worker), "b");
  EXPECT_EQ(*static_cast<char*>(worker.shared()), 'a');
  const Ending ending = worker.End();
  EXPECT_FALSE(ending.crashed);
  EXPECT_EQ(ending.number, 0U);
  EXPECT_FALSE(worker.running());
}

TEST(SystemWorker, ItsEndIsKnown) {
  Worker worker;
  ASSERT_FALSE(worker.Start(1, "", Serve));
  ASSERT_TRUE(worker.Write("y"));
  EXPECT_EQ(Received(worker), "it has ended");
  EXPECT_EQ(worker.End().number, 7U);
  // It can be started again.
  ASSERT_FALSE(worker.Start(1, "", Serve));
  ASSERT_TRUE(worker.Write("x"));
  EXPECT_EQ(Received(worker), "it has ended");
  EXPECT_TRUE(worker.End().crashed);
}

}  // namespace
}  // namespace ecaudit::system
