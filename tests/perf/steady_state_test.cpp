/// The hot path: in the steady state nothing is allocated for a frame, and what the benchmark measures is a healthy run
/// in which every rule that can be judged is judged.
#include <algorithm>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/sentences.h"
#include "decoder/capture/capture_stream.h"
#include "tests/perf/allocations.h"
#include "tests/perf/long_run.h"

namespace ecaudit::perf {
namespace {

/// Passes frames on and notes how much was allocated when frame `from` was asked for, and when the last one was.
class WatchedSource final : public capture::FrameSource {
 public:
  WatchedSource(capture::FrameSource& inner, FrameNo from) : inner_(inner), from_(from) {}

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override {
    const std::uint64_t now = CountedAllocations().count;
    const capture::ReadStatus status = inner_.Next(frame);
    if (status == capture::ReadStatus::kFrame && frame.number == from_) before_ = now;
    if (status == capture::ReadStatus::kFrame) after_ = now;
    return status;
  }
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return inner_.info(); }
  [[nodiscard]] std::uint64_t allocated() const { return after_ - before_; }
  [[nodiscard]] std::uint64_t before() const { return before_; }

 private:
  capture::FrameSource& inner_;
  FrameNo from_;
  std::uint64_t before_ = 0;
  std::uint64_t after_ = 0;
};

struct Run {
  std::size_t slaves;
  bool moving;
};

class SteadyStateTest : public testing::TestWithParam<Run> {};

TEST_P(SteadyStateTest, NothingIsAllocatedForAFrame) {
  constexpr FrameNo kFrames = 12'000;
  constexpr FrameNo kSteady = 7'000;
  for (const samples::FileFormat format : {samples::FileFormat::kPcapNg, samples::FileFormat::kPcapNano}) {
    const samples::Bytes file =
        MakeLongRun({.slaves = GetParam().slaves, .frames = kFrames, .format = format, .moving = GetParam().moving});
    const auto source = capture::OpenCaptureFromMemory(file);
    ASSERT_TRUE(source);
    const std::uint64_t start = CountedAllocations().count;
    WatchedSource watched(**source, kSteady);
    const AnalysisResult result = Analyse(watched, {});
    EXPECT_EQ(result.capture.packets, kFrames);
    EXPECT_EQ(watched.allocated(), 0U) << "in " << kFrames - kSteady << " frames";
    EXPECT_GT(watched.before(), start) << "the start-up allocates, and the counter sees it";
  }
}

TEST_P(SteadyStateTest, TheBenchmarkedRunIsHealthyAndJudged) {
  const samples::Bytes file = MakeLongRun({.slaves = GetParam().slaves, .frames = 8'000, .moving = GetParam().moving});
  const auto source = capture::OpenCaptureFromMemory(file);
  ASSERT_TRUE(source);
  const AnalysisResult result = Analyse(**source, {});
  EXPECT_TRUE(result.findings.empty()) << result.findings.front().rule;
  EXPECT_EQ(result.slaves.size(), GetParam().slaves);
  for (const SlaveSummary& slave : result.slaves) EXPECT_EQ(slave.al_status.value_or(0), 0x0008) << "in OP";
  const std::vector<std::string_view> judged{"wkc-mismatch", "latch-ack-mismatch",  "drive-fault",
                                             "sync-lost",    "pdo-length-mismatch", "frame-lost"};
  for (const NotEvaluable& open : result.not_evaluable) {
    for (const std::string_view rule : judged) EXPECT_NE(open.rule, rule) << report::TextOf(open);
  }
}

INSTANTIATE_TEST_SUITE_P(Slaves, SteadyStateTest, testing::Values(Run{1, false}, Run{3, false}, Run{3, true}),
                         [](const testing::TestParamInfo<Run>& run) {
                           return std::to_string(run.param.slaves) + (run.param.moving ? "Moving" : "AtRest");
                         });

TEST(LongRunTest, BothFormatsHoldTheSamePacketsAndAsManyAsWanted) {
  const samples::Bytes pcapng = MakeLongRun({.slaves = 2, .frames = 3'001});
  const samples::Bytes pcap = MakeLongRun({.slaves = 2, .frames = 3'001, .format = samples::FileFormat::kPcapNano});
  const auto a = capture::OpenCaptureFromMemory(pcapng);
  const auto b = capture::OpenCaptureFromMemory(pcap);
  ASSERT_TRUE(a && b);
  capture::CapturedFrame x;
  capture::CapturedFrame y;
  std::uint64_t packets = 0;
  while ((*a)->Next(x) == capture::ReadStatus::kFrame) {
    ASSERT_EQ((*b)->Next(y), capture::ReadStatus::kFrame);
    ++packets;
    ASSERT_EQ(x.time, y.time);
    ASSERT_TRUE(std::equal(x.bytes.begin(), x.bytes.end(), y.bytes.begin(), y.bytes.end()));
  }
  EXPECT_EQ((*b)->Next(y), capture::ReadStatus::kEnd);
  EXPECT_EQ(packets, 3'002U) << "whole cycles";
}

}  // namespace
}  // namespace ecaudit::perf
