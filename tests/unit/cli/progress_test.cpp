#include "cli/progress.h"

#include <gtest/gtest.h>

namespace ecaudit::cli {
namespace {

TEST(Progress, ShareRateAndTimeLeft) {
  EXPECT_EQ(Progress::Describe("a.pcap", 2.0, 50, 200, 4'000'000),
            "a.pcap  25 %  4,000,000 frames, 2.0 M frames/s, 6 s left");
}

TEST(Progress, UnknownSizeHasNoShare) {
  EXPECT_EQ(Progress::Describe("-", 1.0, 50, 0, 1500), "-  1,500 frames, 2 k frames/s");
}

TEST(Progress, NothingWithoutATerminal) {
  std::FILE* stream = std::tmpfile();
  ASSERT_NE(stream, nullptr);
  {
    const Console console(stream, stream);
    Progress progress(console, "a.pcap");
    progress.Update(1, 2, 3);
  }
  EXPECT_EQ(std::ftell(stream), 0);
  std::fclose(stream);
}

}  // namespace
}  // namespace ecaudit::cli
