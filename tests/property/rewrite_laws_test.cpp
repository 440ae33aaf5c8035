/// Laws: what a master's numbering, padding and addresses look like, what else is on the wire and how the capture was
/// stamped changes no finding; neither does how its datagrams are put into frames.
#include <algorithm>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "tests/property/captures.h"
#include "tests/property/rewrites.h"
#include "tests/property/zoo.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using test::Keeps;
using test::WireCapture;

struct Verdict {
  /// How often each rule fired, for each slave and severity.
  std::map<std::tuple<std::string, int, int>, std::uint64_t> findings;
  std::set<std::string> not_evaluable;
  bool rests_on_numbers = false;  ///< nothing else tells what it shows
};

/// Frames that were lost or came twice are as many as there are frames.
bool CountsFrames(std::string_view rule) {
  return rule.starts_with("frame-");
}

Verdict VerdictOn(std::vector<test::Packet> packets, const capture::CaptureInfo& info, Keeps keeps) {
  test::MemorySource source(std::move(packets), info);
  const AnalysisResult result = Analyse(source, {});
  EXPECT_TRUE(result.capture.frames.Balances());
  Verdict verdict;
  for (const Finding& f : result.findings) {
    // Numbers that go on where another recording begins make one recording of the two, whose clock was set; and where
    // nothing comes back only the same number once more is a repetition.
    if (f.rule == "capture-spliced" || f.rule == "bus-no-answer") verdict.rests_on_numbers = true;
    if (f.rule.starts_with("capture-")) continue;  // about the file
    const int slave = f.slave == kNoSlave ? -1 : static_cast<int>(result.slave(f.slave)->position);
    std::uint64_t& count = verdict.findings[{std::string(f.rule), slave, static_cast<int>(f.severity)}];
    count += keeps == Keeps::kFrames && CountsFrames(f.rule) ? 0 : f.count;
  }
  for (const NotEvaluable& n : result.not_evaluable) verdict.not_evaluable.emplace(n.rule);
  return verdict;
}

/// Empty when there is none.
std::string Difference(const Verdict& before, const Verdict& after, Keeps keeps) {
  std::string text;
  const auto line = [&](const auto& key, std::uint64_t a, std::uint64_t b) {
    text += "\n  " + std::get<0>(key) + " slave " + std::to_string(std::get<1>(key)) + ": " + std::to_string(a) +
            " -> " + std::to_string(b);
  };
  for (const auto& [key, count] : before.findings) {
    const auto found = after.findings.find(key);
    const bool may_be_said = keeps == Keeps::kSaid || keeps == Keeps::kRules;
    if (may_be_said && found == after.findings.end() && after.not_evaluable.contains(std::get<0>(key))) {
      continue;
    }
    if (keeps == Keeps::kRules && found != after.findings.end()) continue;
    if (found == after.findings.end() || found->second != count)
      line(key, count, found == after.findings.end() ? 0 : found->second);
  }
  for (const auto& [key, count] : after.findings) {
    if (!before.findings.contains(key)) line(key, 0, count);
  }
  return text;
}

/// Large captures are tried under a few of the laws, others under more; which ones is the same every time, and
/// different for each capture. All together have to take seconds.
constexpr std::size_t kMostPackets = 30'000;
constexpr std::size_t kLeastLaws = 2;
/// Laws that stand beside each other are alike.
constexpr std::size_t kStep = 11;

std::uint32_t Hash(std::string_view name) {
  std::uint32_t hash = 2'166'136'261;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 16'777'619U;
  return hash ^ hash >> 16U;
}

void CheckLaws(const WireCapture& capture) {
  const std::span<const test::RewriteLaw> laws = test::RewriteLaws();
  ASSERT_EQ(std::gcd(laws.size(), kStep), 1U) << "else some are never tried";
  const std::size_t count =
      std::clamp(kMostPackets / std::max<std::size_t>(capture.packets.size(), 1), kLeastLaws, laws.size());
  const std::size_t first = Hash(capture.name) % laws.size();
  const Verdict all = VerdictOn(capture.packets, capture.info, Keeps::kAll);
  const Verdict kept = VerdictOn(capture.packets, capture.info, Keeps::kFrames);
  for (std::size_t i = 0; i < count; ++i) {
    const test::RewriteLaw& law = laws[(first + i * kStep) % laws.size()];
    if (law.renumbers && all.rests_on_numbers) continue;
    const auto rewritten = law.rewrite(capture);
    if (!rewritten) continue;
    const Verdict& before = law.keeps == Keeps::kFrames ? kept : all;
    const Verdict after = VerdictOn(*rewritten, capture.info, law.keeps);
    EXPECT_EQ(Difference(before, after, law.keeps), "") << capture.name << ", " << law.name;
  }
}

class RewriteLawsTest : public testing::TestWithParam<const char*> {};

TEST_P(RewriteLawsTest, ChangeNoFinding) {
  const std::string folder = GetParam();
  const fs::path path = folder == "samples" ? fs::path(test::SourceDir()) / "samples" / "captures"
                                            : fs::path(test::SharedDir()) / "captures" / folder;
  const std::vector<fs::path> captures = test::CapturesIn(path);
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const fs::path& one : captures) {
    const auto capture = test::LoadCapture(one);
    ASSERT_TRUE(capture) << one;
    CheckLaws(*capture);
  }
}

INSTANTIATE_TEST_SUITE_P(All, RewriteLawsTest, testing::Values("samples", "real", "lab"),
                         [](const testing::TestParamInfo<const char*>& folder) { return std::string(folder.param); });

TEST(ZooRewriteLawsTest, ChangeNoFinding) {
  for (const test::ZooMaster& one : test::ZooMasters(10)) {
    // With neither a bit of the address nor an index, the cycle behind a lost one looks like its return.
    if ((one.way.mac[0] & 0x02U) != 0) continue;
    samples::Story story(one.way);
    story.master.ChangeCycle(24, {.lose = true});
    story.master.ChangeCycle(31, {.lose = true});
    story.master.ChangeCycle(40, {.twice = true});
    samples::PlayHealthyRun(story);
    CheckLaws(test::CaptureOf(story, one.name));
  }
}

}  // namespace
}  // namespace ecaudit
