/// Law: which axis of a drive it is does not matter. Where a capture maps control and status word of the second axis
/// instead of the first one's (6840h, 6841h), all that is found of the drive is found of its second axis.
#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/sentences.h"
#include "decoder/capture/capture_reader.h"
#include "tests/property/captures.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

/// As PDO mapping objects write 6040h and 6041h: bits, subindex, index.
constexpr std::array<std::array<std::uint8_t, 4>, 2> kFirstAxis{{{0x10, 0x00, 0x40, 0x60}, {0x10, 0x00, 0x41, 0x60}}};

/// @return how often control and status word are mapped in these bytes, now as the second axis' ones
std::size_t MapSecondAxis(std::vector<std::uint8_t>& bytes) {
  std::size_t changed = 0;
  for (const auto& entry : kFirstAxis) {
    for (auto at = bytes.begin();; ++at) {
      at = std::search(at, bytes.end(), entry.begin(), entry.end());
      if (at == bytes.end()) break;
      at[3] = 0x68;
      ++changed;
    }
  }
  return changed;
}

struct Judged {
  /// Rule, slave, frame, title.
  std::set<std::tuple<std::string, SlaveId, FrameNo, std::string>> findings;
  std::size_t drives = 0;
};

Judged Judge(const AnalysisResult& result, const std::string& prefix) {
  // Rules about modes look at 6060h and 6061h, which stay the first axis'.
  static const std::set<std::string, std::less<>> kOfWords{
      "drive-fault",          "drive-illegal-command", "drive-illegal-state-change",
      "drive-illegal-status", "drive-no-reaction",     "drive-control-outside-op"};
  Judged judged;
  for (const Finding& finding : result.findings) {
    if (!kOfWords.contains(finding.rule)) continue;
    const std::string title = report::TitleOf(finding);
    EXPECT_TRUE(title.starts_with(prefix)) << title;
    judged.findings.emplace(finding.rule, finding.slave, finding.first.number, title.substr(prefix.size()));
  }
  for (const SlaveSummary& slave : result.slaves) judged.drives += slave.drive && slave.drive->status_word ? 1U : 0U;
  return judged;
}

TEST(FurtherAxis, IsEvaluatedLikeTheFirst) {
  std::size_t drives = 0;
  std::size_t findings = 0;
  for (const fs::path& path : test::CapturesIn(fs::path(test::SharedDir()) / "captures" / "lab")) {
    auto whole = capture::OpenCapture(path.string());
    ASSERT_TRUE(whole) << path;
    const Judged first = Judge(Analyse(**whole, {}), "");
    auto source = capture::OpenCapture(path.string());
    ASSERT_TRUE(source) << path;
    std::size_t changed = 0;
    test::RewrittenSource rewritten(**source, 0, 0, [&](capture::CapturedFrame&, std::vector<std::uint8_t>& bytes) {
      changed += MapSecondAxis(bytes);
      return true;
    });
    const AnalysisResult result = Analyse(rewritten, {});
    if (changed == 0) continue;
    const Judged second = Judge(result, "Axis 2: ");
    EXPECT_EQ(first.findings, second.findings) << path;
    EXPECT_EQ(first.drives, second.drives) << path;
    drives += second.drives;
    findings += second.findings.size();
  }
  if (drives == 0) GTEST_SKIP() << "no captures in " << test::SharedDir();
  EXPECT_GT(findings, 0U);
}

}  // namespace
}  // namespace ecaudit
