/// Law: what a capture shows does not become another truth when its beginning is missing. Dropping the first k frames
/// may lose findings or turn them into inferred ones, and never adds one that claims to be observed.
#include <algorithm>
#include <filesystem>
#include <string>
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
using test::CapturesIn;

AnalysisResult AnalyseFrom(const fs::path& path, FrameNo first) {
  auto source = capture::OpenCapture(path.string());
  EXPECT_TRUE(source) << path;
  AnalysisOptions options;
  options.from_frame = first;
  return source ? Analyse(**source, options) : AnalysisResult{};
}

/// Frames between the outbound and the returned copy of one frame: where the cut takes the former, a finding cites the
/// latter.
constexpr FrameNo kRoundTrip = 4;

/// True when `whole` has the finding, too: the same rule, over the same frames, of the same slave as far as both tell.
bool IsIn(const AnalysisResult& whole, const AnalysisResult& cut, const Finding& finding) {
  return std::any_of(whole.findings.begin(), whole.findings.end(), [&](const Finding& f) {
    // Without the assignment of the addresses, two slaves at one address show in the working counter only.
    const bool same_cause = f.rule == "bus-duplicate-address" && finding.rule == "wkc-mismatch";
    if (f.rule != finding.rule && !same_cause) return false;
    if (f.slave != kNoSlave && finding.slave != kNoSlave && !same_cause) {
      const auto a = whole.slave(f.slave)->station_address;
      const auto b = cut.slave(finding.slave)->station_address;
      if (a && b && *a != *b) return false;
    }
    return finding.first.number >= f.first.number &&
           finding.first.number <= std::max(f.last.number, f.first.number) + kRoundTrip;
  });
}

/// A standing error or fault is the one whose beginning the whole capture shows.
bool StandsSince(const AnalysisResult& whole, const AnalysisResult& cut, const Finding& finding) {
  const bool fault = finding.rule == "drive-fault";
  if (!fault && finding.rule != "al-error-standing") return false;
  return std::any_of(whole.findings.begin(), whole.findings.end(), [&](const Finding& f) {
    const bool began = fault ? f.rule == "drive-fault" : f.rule == "al-refused" || f.rule == "al-unexpected-change";
    if (!began || f.slave == kNoSlave || f.first.number > finding.first.number + kRoundTrip) return false;
    return finding.slave == kNoSlave ||
           whole.slave(f.slave)->station_address == cut.slave(finding.slave)->station_address;
  });
}

/// A slave whose object 1018h tells another product than its EEPROM is another one where the EEPROM was cut off.
bool HasOtherIdentity(const AnalysisResult& whole, const AnalysisResult& cut, const Finding& finding) {
  if (finding.slave == kNoSlave) return false;
  const SlaveSummary& slave = *cut.slave(finding.slave);
  return std::any_of(whole.slaves.begin(), whole.slaves.end(), [&](const SlaveSummary& s) {
    return s.station_address == slave.station_address && s.identity.product_code && slave.identity.product_code &&
           s.identity.product_code != slave.identity.product_code;
  });
}

void CheckCuts(const fs::path& path, const std::vector<double>& shares) {
  const AnalysisResult whole = AnalyseFrom(path, 1);
  std::vector<FrameNo> cuts{2, 3};
  for (const double share : shares) {
    cuts.push_back(1 + static_cast<FrameNo>(share * static_cast<double>(whole.capture.packets)));
  }
  // Right before and right behind what the whole capture reports: the most tempting places.
  for (const Finding& f : whole.findings) {
    if (cuts.size() >= 14) break;
    cuts.push_back(f.first.number > 2 ? f.first.number - 1 : 1);
    cuts.push_back(f.first.number + 1);
  }
  for (const FrameNo first : cuts) {
    const AnalysisResult cut = AnalyseFrom(path, first);
    for (const Finding& finding : cut.findings) {
      if (finding.confidence != Confidence::kObserved || finding.severity == Severity::kInfo) continue;
      if (finding.rule.starts_with("capture-")) continue;  // about the file, which is not cut
      if (HasOtherIdentity(whole, cut, finding) || StandsSince(whole, cut, finding)) continue;
      EXPECT_TRUE(IsIn(whole, cut, finding))
          << path.filename() << " from frame " << first << ": " << finding.rule << " in frame " << finding.first.number
          << ": " << report::TitleOf(finding);
    }
  }
}

/// Law: an error that stands is told wherever the capture begins, as long as it still shows behind the cut and process
/// data run before it does.
void CheckStanding(const fs::path& path) {
  const AnalysisResult whole = AnalyseFrom(path, 1);
  for (const Finding& f : whole.findings) {
    if (f.rule != "al-unexpected-change" || f.count < 2 || f.slave == kNoSlave) continue;
    const AnalysisResult cut = AnalyseFrom(path, f.first.number + 1);
    EXPECT_TRUE(std::any_of(cut.findings.begin(), cut.findings.end(),
                            [](const Finding& told) { return told.severity == Severity::kError; }))
        << path.filename() << " from frame " << f.first.number + 1;
  }
}

TEST(MidRunCut, StandingErrorsAreReported) {
  for (const fs::path& path : CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures")) CheckStanding(path);
  const fs::path lab = fs::path(test::SharedDir()) / "captures" / "lab";
  if (!fs::exists(lab)) return;
  for (const fs::path& path : CapturesIn(lab)) CheckStanding(path);
}

TEST(MidRunCut, SamplesGainNoFinding) {
  const std::vector<fs::path> samples = CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures");
  ASSERT_FALSE(samples.empty());
  for (const fs::path& path : samples) CheckCuts(path, {0.1, 0.25, 0.5, 0.75, 0.9});
}

TEST(MidRunCut, RealCapturesGainNoFinding) {
  const fs::path folder = fs::path(test::SharedDir()) / "captures" / "real";
  if (!fs::exists(folder)) GTEST_SKIP() << "the real captures are not beside the project";
  for (const fs::path& path : CapturesIn(folder)) CheckCuts(path, {0.05, 0.15, 0.3, 0.5, 0.7, 0.95});
}

TEST(MidRunCut, LabCapturesGainNoFinding) {
  const fs::path folder = fs::path(test::SharedDir()) / "captures" / "lab";
  if (!fs::exists(folder)) GTEST_SKIP() << "the lab captures are not beside the project";
  for (const fs::path& path : CapturesIn(folder)) CheckCuts(path, {0.05, 0.3, 0.6});
}

}  // namespace
}  // namespace ecaudit
