/// Law: a recorder that leaves out packets here and there adds no error to a report, and where it takes a finding away
/// the report says that something is missing. Unlike in missing_packets_test.cpp the captures need not be healthy.
#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/sentences.h"
#include "tests/property/captures.h"
#include "tests/property/wire_packets.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using test::Packet;
using test::WireCapture;

AnalysisResult AnalysisOf(std::vector<Packet> packets, const capture::CaptureInfo& info) {
  test::MemorySource source(std::move(packets), info);
  AnalysisResult result = Analyse(source, {});
  EXPECT_TRUE(result.capture.frames.Balances());
  return result;
}

template <typename Drop>
std::vector<Packet> Without(const WireCapture& capture, Drop drop) {
  std::vector<Packet> packets;
  for (std::size_t i = 0; i < capture.packets.size(); ++i) {
    if (!drop(i)) packets.push_back(capture.packets[i]);
  }
  return packets;
}

/// Left out at random, the same ones each time.
std::vector<Packet> WithoutOneIn(const WireCapture& capture, unsigned many, unsigned seed) {
  std::mt19937 random(seed);
  return Without(capture, [&](std::size_t) { return random() % many == 0; });
}

/// What some missing packets make of these is another error about the same fault.
struct KnownCase {
  std::string_view capture;
  std::string_view rule;
  std::string_view why;
};
constexpr KnownCase kKnown[] = {
    {"refusal-never-acknowledged.pcapng", "al-error-standing",
     "the request that was refused is gone: the error that stands is reported, not the refusal"},
    {"two-slaves-one-refuses.pcapng", "al-error-standing",
     "around the request three packets are gone: what stands behind the hole is told, not the refusal"},
    {"unexpected-error-unread.pcapng", "al-refused",
     "every look at the state in which it was OP is gone: the drive seems to have refused the last request"},
    {"position-and-station-falls.pcapng", "al-error-standing",
     "the only look at the state in which it was OP is gone: the error that stands is reported, not the change"},
    {"pdo-odd-mapping.pcapng", "pdo-assign-order",
     "the answer to the download of subindex 0 is gone; that its request was taken is not concluded yet"},
};

bool IsKnown(std::string_view capture, std::string_view rule) {
  return std::any_of(std::begin(kKnown), std::end(kKnown),
                     [&](const KnownCase& k) { return k.capture == capture && k.rule == rule; });
}

/// A frame of which one copy is missing looks as if the bus had lost it; with so many missing the outbound copies that
/// are, too, show who it was.
constexpr std::size_t kMany = 30;

/// Where only returns are missing they seem to be lost, and nothing shows that the capture misses more.
bool SaysThatFramesWereLost(const AnalysisResult& result) {
  return std::any_of(result.findings.begin(), result.findings.end(),
                     [](const Finding& f) { return f.rule == "frame-lost"; });
}

/// The rule that found it says that it could not look everywhere; or it has nothing to look at any more.
bool IsSaid(const AnalysisResult& result, std::string_view rule) {
  return std::any_of(result.not_evaluable.begin(), result.not_evaluable.end(),
                     [&](const NotEvaluable& n) { return n.rule == rule; });
}

void Check(const WireCapture& capture, const AnalysisResult& whole, const std::string& how,
           std::vector<Packet> packets) {
  const std::size_t dropped = capture.packets.size() - packets.size();
  const AnalysisResult less = AnalysisOf(std::move(packets), capture.info);
  for (const Finding& f : less.findings) {
    if (f.severity != Severity::kError || f.rule.starts_with("capture-") || f.caused_by != kNoFinding) continue;
    if (f.rule == "frame-lost" && dropped < kMany) continue;
    if (IsKnown(capture.name, f.rule)) continue;
    const bool before = std::any_of(whole.findings.begin(), whole.findings.end(), [&](const Finding& w) {
      return w.rule == f.rule && (w.slave == f.slave || w.slave == kNoSlave || f.slave == kNoSlave);
    });
    EXPECT_TRUE(before) << capture.name << ", " << how << ", adds " << f.rule << " in frame " << f.first.number << ": "
                        << report::TitleOf(f);
  }
  for (const Finding& w : whole.findings) {
    if (w.severity == Severity::kInfo || w.rule.starts_with("capture-")) continue;
    const bool kept =
        std::any_of(less.findings.begin(), less.findings.end(), [&](const Finding& f) { return f.rule == w.rule; });
    EXPECT_TRUE(kept || IsSaid(less, w.rule) || SaysThatFramesWereLost(less))
        << capture.name << ", " << how << ", takes away without a word: " << w.rule << " in frame " << w.first.number
        << ": " << report::TitleOf(w);
  }
}

class DroppedPacketsTest : public testing::TestWithParam<const char*> {};

TEST_P(DroppedPacketsTest, AddNoErrorAndTakeNothingAwayInSilence) {
  const std::string folder = GetParam();
  const fs::path path = folder == "samples" ? fs::path(test::SourceDir()) / "samples" / "captures"
                                            : fs::path(test::SharedDir()) / "captures" / folder;
  const std::vector<fs::path> captures = test::CapturesIn(path);
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  unsigned seed = 0;
  for (const fs::path& one : captures) {
    const auto capture = test::LoadCapture(one);
    ASSERT_TRUE(capture) << one;
    const AnalysisResult whole = AnalysisOf(capture->packets, capture->info);
    ++seed;
    Check(*capture, whole, "without one in 1000", WithoutOneIn(*capture, 1000, seed));
    Check(*capture, whole, "without one in 20", WithoutOneIn(*capture, 20, seed));
    Check(*capture, whole, "without every 124th", Without(*capture, [](std::size_t i) { return i % 124 == 123; }));
  }
}

INSTANTIATE_TEST_SUITE_P(All, DroppedPacketsTest, testing::Values("samples", "real", "lab"),
                         [](const testing::TestParamInfo<const char*>& folder) { return std::string(folder.param); });

}  // namespace
}  // namespace ecaudit
