/// Laws: how a capture is presented does not change what it shows. Packets of others in front of it renumber the
/// findings and nothing else; tags around its frames change nothing; and what was shown before the end of a capture
/// was shown whatever comes later.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "decoder/base/bytes.h"
#include "decoder/capture/capture_reader.h"
#include "tests/property/captures.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

constexpr FrameNo kInFront = 1000;

/// What a finding says but for frame numbers in its words.
std::string Line(const AnalysisResult& result, const Finding& f, FrameNo shift) {
  std::string line(Name(f.severity));
  line += " " + std::string(f.rule) + " slave " + std::to_string(f.slave == kNoSlave ? -1 : int{f.slave}) + " frame " +
          std::to_string(f.first.number - shift) + " to " +
          std::to_string(std::max(f.last.number, f.first.number) - shift) + " count " + std::to_string(f.count);
  if (f.confidence == Confidence::kInferred) line += " inferred";
  if (f.caused_by != kNoFinding) line += " by " + std::string(result.findings[f.caused_by].rule);
  return line;
}

std::vector<std::string> Lines(const AnalysisResult& result, FrameNo shift = 0) {
  std::vector<std::string> lines;
  for (const Finding& f : result.findings) {
    if (f.rule.starts_with("capture-")) continue;  // about the file
    lines.push_back(Line(result, f, shift));
  }
  return lines;
}

AnalysisResult Present(const fs::path& path, std::size_t before, FrameNo until,
                       test::RewrittenSource::Rewrite rewrite) {
  auto inner = capture::OpenCapture(path.string());
  EXPECT_TRUE(inner) << path;
  if (!inner) return {};
  test::RewrittenSource source(**inner, before, until, std::move(rewrite));
  return Analyse(source, {});
}

/// Puts an 802.1Q tag behind the MAC addresses of an Ethernet frame.
bool Tag(capture::CapturedFrame& frame, std::vector<std::uint8_t>& bytes) {
  if (frame.link_type != 1 || bytes.size() < 14) return true;
  const std::uint8_t tag[] = {0x81, 0x00, 0x60, 0x05};
  bytes.insert(bytes.begin() + 12, std::begin(tag), std::end(tag));
  return true;
}

class PresentationTest : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static std::vector<fs::path> Captures() {
    const std::string folder = GetParam();
    if (folder == "samples") return test::CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures");
    return test::CapturesIn(fs::path(test::SharedDir()) / "captures" / folder);
  }
};

TEST_P(PresentationTest, PacketsInFrontRenumberAndNothingElse) {
  const std::vector<fs::path> captures = Captures();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const fs::path& path : captures) {
    const auto plain = Lines(Present(path, 0, 0, {}));
    EXPECT_EQ(Lines(Present(path, kInFront, 0, {}), kInFront), plain) << path.filename();
  }
}

TEST_P(PresentationTest, TagsAroundFramesChangeNothing) {
  const std::vector<fs::path> captures = Captures();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const fs::path& path : captures) {
    EXPECT_EQ(Lines(Present(path, 0, 0, Tag)), Lines(Present(path, 0, 0, {}))) << path.filename();
  }
}

/// Frames behind a finding's last one until which it must be known: the reader looks ahead, and a loss shows only when
/// later frames come back.
constexpr FrameNo kUntilKnown = 700;

TEST_P(PresentationTest, WhatWasShownBeforeTheEndStaysFound) {
  const std::vector<fs::path> captures = Captures();
  if (captures.empty()) GTEST_SKIP() << "no captures beside the project";
  for (const fs::path& path : captures) {
    const AnalysisResult whole = Present(path, 0, 0, {});
    std::size_t tried = 0;
    for (const Finding& f : whole.findings) {
      // What proves it may come later: a time-out cites its request and, among the related frames, the last look.
      FrameNo proof = f.first.number;
      for (const FrameNo frame : f.related_frames) proof = std::max(proof, frame);
      const FrameNo until = proof + kUntilKnown;
      if (f.severity == Severity::kInfo || until >= whole.capture.packets || ++tried > 4) continue;
      const AnalysisResult cut = Present(path, 0, until, {});
      const bool found = std::any_of(cut.findings.begin(), cut.findings.end(), [&](const Finding& c) {
        return c.rule == f.rule && c.first.number == f.first.number && c.slave == f.slave;
      });
      EXPECT_TRUE(found) << path.filename() << " until frame " << until << " lacks: " << Line(whole, f, 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PresentationTest, testing::Values("samples", "real", "lab"),
                         [](const testing::TestParamInfo<const char*>& folder) { return std::string(folder.param); });

}  // namespace
}  // namespace ecaudit
