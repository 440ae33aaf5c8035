/// Law: packets that the capture misses make no finding. A healthy run stays without observed errors and warnings when
/// parts of it are not captured: a range of packets, or many here and there. With a few here and there not even
/// inferred ones are allowed: what is found in such a capture is not lowered to an info.
#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
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
using Rewrite = test::RewrittenSource::Rewrite;

AnalysisResult AnalyseWithout(const fs::path& path, Rewrite keep) {
  auto inner = capture::OpenCapture(path.string());
  EXPECT_TRUE(inner) << path;
  if (!inner) return {};
  test::RewrittenSource source(**inner, 0, 0, std::move(keep));
  return Analyse(source, {});
}

bool IsObserved(const Finding& finding) {
  return finding.severity != Severity::kInfo && finding.confidence == Confidence::kObserved;
}

Rewrite GapBefore(FrameNo first, FrameNo count) {
  return [=](capture::CapturedFrame& frame, std::vector<std::uint8_t>&) {
    return frame.number < first || frame.number >= first + count;
  };
}

/// The numbers of the packets before which nothing is in flight: whole exchanges lie between any two of them.
std::vector<FrameNo> Edges(const fs::path& path) {
  constexpr std::size_t kSource = 6;            // of the MAC addresses
  constexpr std::uint8_t kSetByFirstSlave = 2;  // in its first byte
  std::vector<FrameNo> edges;
  int in_flight = 0;
  AnalyseWithout(path, [&](capture::CapturedFrame& frame, std::vector<std::uint8_t>&) {
    if (in_flight == 0) edges.push_back(frame.number);
    const bool returned = frame.bytes.size() > kSource && (frame.bytes[kSource] & kSetByFirstSlave) != 0;
    in_flight = returned ? std::max(in_flight - 1, 0) : in_flight + 1;
    return true;
  });
  return edges;
}

/// Leaves out `percent` of the packets, the same ones each time.
Rewrite Sieve(unsigned percent) {
  return [percent, random = std::mt19937(percent)](capture::CapturedFrame&, std::vector<std::uint8_t>&) mutable {
    return random() % 100 >= percent;
  };
}

void ExpectSilence(const fs::path& path, const std::string& damage, Rewrite keep, bool losses_show) {
  for (const Finding& finding : AnalyseWithout(path, std::move(keep)).findings) {
    if (finding.rule.starts_with("capture-") || (losses_show && finding.rule == "frame-lost")) continue;
    EXPECT_FALSE(IsObserved(finding)) << path.filename() << ", " << damage << ": " << finding.rule << " in frame "
                                      << finding.first.number << ": " << report::TitleOf(finding);
  }
}

/// Its master writes one index into all frames: where both copies of a request are missing nothing shows that anything
/// is, and what follows seems to be the slave's own doing.
constexpr const char* kUnnumbered = "master-codesys.pcapng";

class MissingPacketsTest : public testing::TestWithParam<const char*> {
 protected:
  /// Those without errors and warnings, and not too long to be read many times.
  [[nodiscard]] static std::vector<std::pair<fs::path, std::uint64_t>> Healthy() {
    constexpr std::uintmax_t kMostBytes = 400'000;
    const std::string folder = GetParam();
    const fs::path path = folder == "samples" ? fs::path(test::SourceDir()) / "samples" / "captures"
                                              : fs::path(test::SharedDir()) / "captures" / folder;
    std::vector<std::pair<fs::path, std::uint64_t>> healthy;
    for (const fs::path& capture : test::CapturesIn(path)) {
      if (fs::file_size(capture) > kMostBytes || capture.filename() == kUnnumbered) continue;
      const AnalysisResult whole = AnalyseWithout(capture, {});
      if (std::none_of(whole.findings.begin(), whole.findings.end(),
                       [](const Finding& f) { return f.severity != Severity::kInfo; })) {
        healthy.emplace_back(capture, whole.capture.packets);
      }
    }
    return healthy;
  }
};

TEST_P(MissingPacketsTest, GapsMakeNoFinding) {
  const auto captures = Healthy();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const auto& [path, packets] : captures) {
    std::mt19937 random(1);
    for (const FrameNo length : {1U, 2U, 5U, 12U, 20U, 45U, 100U}) {
      if (length * 2 > packets) continue;
      for (int i = 0; i < 3; ++i) {
        // Behind the frames from which the tool learns how the master numbers them.
        const FrameNo first = 40 + random() % (packets - length);
        // This master does so only behind its scan, which writes 0xFF into all frames; and until the first process
        // data only frames of two kinds have shown that they share a counter.
        if (fs::path(path).filename() == "clean-twincat-habits.pcapng" && first < 250) continue;
        // A single packet more or less looks as if it was lost on the bus; so does, in the one capture whose master
        // leaves frames without a number in between, a return with a few of these behind it.
        const bool unnumbered = fs::path(path).filename() == "twincat-scan-boxes.pcapng";
        ExpectSilence(path, std::to_string(length) + " packets from " + std::to_string(first), GapBefore(first, length),
                      length <= (unnumbered ? 5U : 2U));
      }
    }
  }
}

/// Nothing but the numbers of the frames shows that something is missing. Where whole rounds of them are (SOEM has 16
/// numbers) nothing does.
TEST_P(MissingPacketsTest, WholeExchangesMissingMakeNoFindingAtAll) {
  const auto captures = Healthy();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const auto& [path, packets] : captures) {
    // The tool learns from the first frames how the master numbers them.
    constexpr std::size_t kLearned = 20;
    const std::vector<FrameNo> edges = Edges(path);
    std::mt19937 random(1);
    for (const std::size_t exchanges : {1U, 3U, 7U, 13U, 30U, 60U, 120U}) {
      for (int i = 0; i < 3 && exchanges * 2 + kLearned < edges.size(); ++i) {
        const std::size_t from = kLearned + random() % (edges.size() - exchanges - kLearned);
        const FrameNo first = edges[from];
        const FrameNo count = edges[from + exchanges] - first;
        if (count % 2 != 0) continue;  // a frame was lost there
        for (const Finding& finding : AnalyseWithout(path, GapBefore(first, count)).findings) {
          if (finding.severity == Severity::kInfo) continue;
          ADD_FAILURE() << path.filename() << ", without " << count << " packets from " << first << ": " << finding.rule
                        << " in frame " << finding.first.number << ": " << report::TitleOf(finding);
        }
      }
    }
  }
}

TEST_P(MissingPacketsTest, ManyMissingPacketsMakeNoFinding) {
  const auto captures = Healthy();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const auto& [path, packets] : captures) {
    for (const unsigned percent : {20U, 50U, 70U}) {
      ExpectSilence(path, "without " + std::to_string(percent) + " %", Sieve(percent), true);
    }
  }
}

TEST_P(MissingPacketsTest, FewMissingPacketsMakeNoFindingAtAll) {
  const auto captures = Healthy();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const auto& [path, packets] : captures) {
    for (const unsigned percent : {2U, 4U, 7U}) {
      for (const Finding& finding : AnalyseWithout(path, Sieve(percent)).findings) {
        if (finding.severity == Severity::kInfo || finding.rule == "frame-lost") continue;
        ADD_FAILURE() << path.filename() << ", without " << percent << " %: " << finding.rule << " in frame "
                      << finding.first.number << ": " << report::TitleOf(finding);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, MissingPacketsTest, testing::Values("samples", "real", "lab"),
                         [](const testing::TestParamInfo<const char*>& folder) { return std::string(folder.param); });

}  // namespace
}  // namespace ecaudit
