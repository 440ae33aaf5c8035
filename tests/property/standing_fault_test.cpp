/// Law: a fault does not go away because its beginning is not in the capture. Wherever a faulty capture is cut behind
/// the beginning of its fault, as long as the fault stands and still shows, the verdict is not "pass".
///
/// What stands when is read from the uncut capture: AL Status with its error bit, and status words of a drive in Fault.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/report.h"
#include "decoder/base/bytes.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/wire/command.h"
#include "tests/property/captures.h"
#include "tests/property/wire_packets.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using test::WireCapture;

constexpr std::uint16_t kAlErrorBit = 0x10;
constexpr std::uint16_t kAlStatusRegister = 0x0130;
/// Larger captures would take longer than they tell.
constexpr std::uintmax_t kMostBytes = 2'000'000;
/// In fewer cycles a word may be anything where nothing tells that it is a status word.
constexpr std::size_t kLeastCycles = 10;

/// From the frame that shows it to the one that shows its end.
struct Standing {
  bool drive = false;  ///< else AL Status
  SlavePos slave = 0;
  FrameNo from = 0;
  FrameNo until = 0;
};

/// Errors of slaves of which a finding tells: a bit that only echoes an acknowledge is none.
bool HasError(const AnalysisResult& result, SlaveId slave, bool drive) {
  return std::any_of(result.findings.begin(), result.findings.end(), [&](const Finding& f) {
    const bool about = drive ? f.rule == "drive-fault" : f.rule.starts_with("al-");
    return about && f.severity == Severity::kError && (f.slave == slave || f.slave == kNoSlave);
  });
}

std::vector<Standing> WhatStands(const AnalysisResult& result) {
  std::vector<Standing> all;
  const auto end = static_cast<FrameNo>(result.capture.packets + 1);
  const auto begin = [&](bool drive, const SlaveSummary& slave, FrameNo frame) {
    all.push_back({drive, slave.position, frame, end});
  };
  for (const SlaveSummary& slave : result.slaves) {
    bool stands = false;
    const bool al = HasError(result, slave.id, false);
    for (const AlStep& step : slave.al_history) {
      if (step.kind != AlStep::Kind::kState || !al) continue;
      const bool error = (step.to & kAlErrorBit) != 0 && !step.echo;
      if (error && !stands) begin(false, slave, step.frame.number);
      if (!error && stands) all.back().until = step.frame.number;
      stands = error;
    }
    if (!slave.drive || !HasError(result, slave.id, true)) continue;
    stands = false;
    for (const DriveStep& step : slave.drive->history) {
      if (step.kind != DriveStep::Kind::kState) continue;
      const bool fault = step.to.starts_with("Fault");
      if (fault && !stands) begin(true, slave, step.frame.number);
      if (!fault && stands) all.back().until = step.frame.number;
      stands = fault;
    }
  }
  return all;
}

/// What packets show: read from their bytes, by nothing that is tested here.
class Shown {
 public:
  explicit Shown(const WireCapture& capture) {
    for (const test::Packet& packet : capture.packets) {
      errors_.push_back(ErrorIn(packet));
      cycles_.push_back(cycles_.empty() ? 0 : cycles_.back());
      const auto part = test::FindEtherCat(packet);
      // Both copies of a frame.
      if (part && part->cyclic) ++cycles_.back();
    }
  }
  /// An error that is read once may be on its way out.
  [[nodiscard]] bool ErrorStands(FrameNo from, FrameNo until) const {
    std::size_t reads = 0;
    for (FrameNo f = from; f < until && f <= errors_.size(); ++f) reads += errors_[f - 1] ? 1 : 0;
    return reads >= 2;
  }
  [[nodiscard]] std::size_t Cycles(FrameNo from, FrameNo until) const {
    const std::size_t last = std::min<std::size_t>(until, cycles_.size()) - 1;
    return from > last ? 0 : (cycles_[last] - cycles_[from - 1]) / 2;
  }

 private:
  static bool ErrorIn(const test::Packet& packet) {
    const auto part = test::FindEtherCat(packet);
    if (!part) return false;
    for (std::size_t i = 0; i < part->count(); ++i) {
      const std::size_t at = part->datagrams[i];
      const ByteSpan bytes(packet.bytes.data() + at, part->datagrams[i + 1] - at);
      const auto command = static_cast<wire::Command>(bytes[0]);
      const bool reads =
          command == wire::Command::FPRD || command == wire::Command::APRD || command == wire::Command::BRD;
      // header, two bytes of data and the working counter
      if (!reads || bytes.size() < 14 || LittleEndian<std::uint16_t>(bytes, 4) != kAlStatusRegister) continue;
      const auto wkc = LittleEndian<std::uint16_t>(bytes, bytes.size() - 2);
      if (wkc > 0 && (LittleEndian<std::uint16_t>(bytes, 10) & kAlErrorBit) != 0) return true;
    }
    return false;
  }

  std::vector<bool> errors_;         ///< by packet
  std::vector<std::size_t> cycles_;  ///< packets with process data up to this one
};

std::string VerdictOf(AnalysisResult result) {
  report::CaptureReport capture;
  capture.result = std::move(result);
  return std::string(report::Summarise(capture).Verdict());
}

AnalysisResult ByOption(const fs::path& path, FrameNo first) {
  auto source = capture::OpenCapture(path.string());
  AnalysisOptions options;
  options.from_frame = first;
  return source ? Analyse(**source, options) : AnalysisResult{};
}

AnalysisResult ByHand(const WireCapture& capture, FrameNo first) {
  test::MemorySource source({capture.packets.begin() + static_cast<std::ptrdiff_t>(first - 1), capture.packets.end()},
                            capture.info);
  return Analyse(source, {});
}

/// @return places that were tried
std::size_t CutWhereItStands(const fs::path& path) {
  const AnalysisResult whole = ByOption(path, 1);
  const std::vector<Standing> standing = WhatStands(whole);
  if (standing.empty()) return 0;
  const auto capture = test::LoadCapture(path);
  EXPECT_TRUE(capture) << path;
  if (!capture) return 0;
  const Shown shown(*capture);
  std::size_t tried = 0;
  for (const Standing& one : standing) {
    for (const unsigned percent : {0U, 10U, 50U, 80U, 95U}) {
      const FrameNo first = one.from + 1 + (one.until - one.from) * percent / 100;
      const bool shows =
          one.drive ? shown.Cycles(first, one.until) >= kLeastCycles : shown.ErrorStands(first, one.until);
      if (!shows) continue;
      ++tried;
      const std::string where = path.filename().string() + " from frame " + std::to_string(first) + ": slave " +
                                std::to_string(one.slave) + (one.drive ? ", drive in Fault" : ", AL Status with error");
      EXPECT_NE(VerdictOf(ByOption(path, first)), "pass") << where;
      EXPECT_NE(VerdictOf(ByHand(*capture, first)), "pass") << where;
    }
  }
  return tried;
}

TEST(StandingFault, IsNoPassWhereverASampleBegins) {
  std::size_t tried = 0;
  for (const fs::path& path : test::CapturesIn(fs::path(test::SourceDir()) / "samples" / "captures")) {
    tried += CutWhereItStands(path);
  }
  EXPECT_GE(tried, 10U) << "else the law says nothing";
}

TEST(StandingFault, IsNoPassWhereverALabCaptureBegins) {
  const fs::path folder = fs::path(test::SharedDir()) / "captures" / "lab";
  if (!fs::exists(folder)) GTEST_SKIP() << "the lab captures are not beside the project";
  std::size_t tried = 0;
  for (const fs::path& path : test::CapturesIn(folder)) tried += CutWhereItStands(path);
  EXPECT_GE(tried, 5U) << "else the law says nothing";
}

/// The other way round: a guess from content must not spoil what is healthy.
TEST(StandingFault, NoHealthyCaptureIsDoubtedWhereverItBegins) {
  const fs::path samples = fs::path(test::SourceDir()) / "samples" / "captures";
  const fs::path captures = fs::path(test::SharedDir()) / "captures";
  for (const fs::path& folder : {samples, captures / "lab", captures / "real"}) {
    for (const fs::path& path : test::CapturesIn(folder)) {
      const AnalysisResult whole = ByOption(path, 1);
      const bool fault = std::any_of(whole.findings.begin(), whole.findings.end(),
                                     [](const Finding& f) { return f.rule == "drive-fault"; });
      const std::string name = path.filename().string();
      if (fault || name.starts_with("mid-run-in-fault") || fs::file_size(path) > kMostBytes) continue;
      for (const unsigned percent : {30U, 60U, 85U}) {
        const auto first = static_cast<FrameNo>(1 + whole.capture.packets * percent / 100);
        EXPECT_EQ(ByOption(path, first).cut.find("reads like the status word"), std::string::npos)
            << name << " from frame " << first;
      }
    }
  }
}

}  // namespace
}  // namespace ecaudit
