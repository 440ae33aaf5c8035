/// Law: who the master is makes no finding and hides none. One healthy run, and runs with one fault, in the ways of all
/// masters of the zoo.
#include "tests/property/zoo.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/sentences.h"

namespace ecaudit {
namespace {

using samples::Story;
using test::ZooMaster;

constexpr int kMixed = 24;
constexpr std::uint8_t kInit = 1;
constexpr std::uint8_t kOp = 8;

AnalysisResult AnalysisOf(const Story& story) {
  test::WireCapture capture = test::CaptureOf(story, "zoo");
  test::MemorySource source(std::move(capture.packets), capture.info);
  AnalysisResult result = Analyse(source, {});
  EXPECT_TRUE(result.capture.frames.Balances());
  return result;
}

std::uint64_t CountOf(const AnalysisResult& result, std::string_view rule) {
  std::uint64_t count = 0;
  for (const Finding& f : result.findings) {
    if (f.rule == rule) count += f.count;
  }
  return count;
}

/// Errors and warnings but for the named rule, one a line.
std::string Others(const AnalysisResult& result, std::string_view expected = {}) {
  std::string text;
  for (const Finding& f : result.findings) {
    if (f.severity == Severity::kInfo || f.rule == expected) continue;
    text += "\n  " + std::string(f.rule) + " in frame " + std::to_string(f.first.number) + ": " + report::TitleOf(f);
  }
  return text;
}

bool SaysThatFramesAreMissing(const AnalysisResult& result) {
  return std::any_of(result.not_evaluable.begin(), result.not_evaluable.end(), [](const NotEvaluable& n) {
    return n.reason.code == ReasonCode::kMissesPackets || n.reason.code == ReasonCode::kCaptureGap ||
           report::TextOf(n).find("misses frames") != std::string::npos;
  });
}

/// The bit that slaves set is set already.
bool HasDirectionBit(const samples::MasterWay& way) {
  return (way.mac[0] & 0x02U) != 0;
}

bool WasInOp(const SlaveSummary& slave) {
  return std::any_of(slave.al_history.begin(), slave.al_history.end(),
                     [](const AlStep& step) { return step.kind == AlStep::Kind::kState && (step.to & 0x0FU) == kOp; });
}

/// Two drives in operation, with the time distributed.
void PlayToOp(Story& story) {
  story.Add(samples::AkdDrive());
  story.Add(samples::AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.SetUpClocks(4);
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = 2 * samples::kMs, .distributes_time = true, .reads_al_status = true});
  story.master.Cycles(10);
}

TEST(Zoo, AHealthyRunIsHealthyUnderAnyMaster) {
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    SCOPED_TRACE(one.name);
    Story story(one.way);
    samples::PlayHealthyRun(story);
    const AnalysisResult result = AnalysisOf(story);
    EXPECT_EQ(Others(result), "");
    EXPECT_FALSE(SaysThatFramesAreMissing(result));
    EXPECT_EQ(result.capture.frames.returned, result.capture.frames.outbound);
    EXPECT_EQ(result.capture.outbound_frames, result.capture.returned_frames);
    ASSERT_EQ(result.slaves.size(), 3U);
    for (const SlaveSummary& slave : result.slaves) {
      EXPECT_TRUE(WasInOp(slave)) << "slave " << slave.position;
      EXPECT_EQ(slave.al_status.value_or(0) & 0x0FU, kInit) << "slave " << slave.position;
      EXPECT_TRUE(slave.identity.product_code) << "slave " << slave.position;
    }
    EXPECT_EQ(result.slaves[0].mailbox.sdo_uploads, 3U);
    EXPECT_EQ(result.slaves[2].mailbox.sdo_uploads, 2U);
  }
}

TEST(Zoo, AnotherStartIsNoGapUnderAnyMaster) {
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    SCOPED_TRACE(one.name);
    Story story(one.way);
    PlayToOp(story);
    story.master.ShutDown();
    story.master.Wait(300 * samples::kMs);
    story.master.Scan();
    story.master.BringToPreop();
    const AnalysisResult result = AnalysisOf(story);
    EXPECT_EQ(Others(result), "");
    EXPECT_FALSE(SaysThatFramesAreMissing(result));
    EXPECT_EQ(result.slaves.size(), 2U);
  }
}

TEST(Zoo, LostProcessDataAreCountedUnderAnyMaster) {
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    SCOPED_TRACE(one.name);
    Story story(one.way);
    PlayToOp(story);
    for (const int cycle : {3, 11, 12, 20}) story.master.ChangeCycle(story.master.next_cycle() + cycle, {.lose = true});
    story.master.Cycles(40);
    const AnalysisResult result = AnalysisOf(story);
    EXPECT_EQ(CountOf(result, "frame-lost"), 4U);
    EXPECT_EQ(result.capture.frames.lost, 4U);
    EXPECT_EQ(Others(result, "frame-lost"), "");
  }
}

TEST(Zoo, ARecorderThatLeavesPacketsOutRegularlyLosesNoFramesOfANumberingMaster) {
  for (const samples::NamedWay& one : samples::MasterWays()) {
    // Which copy is missing shows by the numbers, and where it stood while one frame is under way at a time.
    if (one.way.numbering.all.first == one.way.numbering.all.last || one.way.grouping.own_frames) continue;
    SCOPED_TRACE(one.name);
    Story story(one.way);
    samples::PlayHealthyRun(story, 60);
    story.capture.style.drops_every = 124;
    const AnalysisResult result = AnalysisOf(story);
    EXPECT_EQ(Others(result), "");
    EXPECT_EQ(result.capture.frames.lost, 0U);
    EXPECT_GT(result.capture.frames.undecided[static_cast<std::size_t>(bus::Undecided::kRecorder)], 0U);
  }
}

TEST(Zoo, AFrameThatIsSentAgainWasLostUnderAnyMaster) {
  constexpr TimeNs kAfter[] = {samples::kMs / 2, 2 * samples::kMs, 5 * samples::kMs};
  std::size_t turn = 0;
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    // One of the last two for each, and the shortest for all.
    for (const TimeNs after : {kAfter[0], kAfter[1 + turn++ % 2]}) {
      SCOPED_TRACE(one.name + ", again after " + std::to_string(after / 1000) + " us");
      samples::MasterWay way = one.way;
      way.frame_timeout = after;
      Story story(way);
      story.Add(samples::AkdDrive());
      story.master.Scan();
      story.master.LoseNext(1);
      story.master.BringToPreop();
      story.master.Upload(0, 0x1018, 1);
      const AnalysisResult result = AnalysisOf(story);
      EXPECT_EQ(Others(result, "frame-lost"), "");
      const bus::FrameLedger& frames = result.capture.frames;
      if (HasDirectionBit(way)) continue;  // sent twice looks as if it came back, and nobody had taken part in it
      EXPECT_EQ(frames.lost + frames.undecided_total(), 1U);
      // With another index it is the next frame after a silence.
      if (!way.renumbers_repetitions) {
        EXPECT_EQ(CountOf(result, "frame-lost"), 1U);
      }
    }
  }
}

TEST(Zoo, FramesThatComeBackTwiceAreSeenUnderAnyMaster) {
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    SCOPED_TRACE(one.name);
    Story story(one.way);
    PlayToOp(story);
    for (const int cycle : {4, 9, 15}) story.master.ChangeCycle(story.master.next_cycle() + cycle, {.twice = true});
    story.master.Cycles(30);
    const AnalysisResult result = AnalysisOf(story);
    EXPECT_EQ(CountOf(result, "frame-duplicated"), 3U);
    EXPECT_EQ(Others(result, "frame-duplicated"), "");
  }
}

TEST(Zoo, ASlaveThatDropsOutIsMissedUnderAnyMaster) {
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    SCOPED_TRACE(one.name);
    Story story(one.way);
    PlayToOp(story);
    story.bus.BreakBehind(1);
    story.master.Cycles(12);
    story.bus.Heal();
    story.master.Cycles(20);
    const AnalysisResult result = AnalysisOf(story);
    const auto missed = std::find_if(result.findings.begin(), result.findings.end(), [](const Finding& f) {
      return f.rule == "wkc-mismatch" && f.severity == Severity::kError;
    });
    EXPECT_NE(missed, result.findings.end()) << Others(result);
    EXPECT_EQ(CountOf(result, "frame-lost"), 0U);
  }
}

TEST(Zoo, NoAnswerUnderAnyMaster) {
  for (const ZooMaster& one : test::ZooMasters(kMixed)) {
    SCOPED_TRACE(one.name);
    Story story(one.way);
    story.Add(samples::AkdDrive());
    story.master.LoseNext(1000);
    for (int i = 0; i < 20; ++i) story.master.Brd(0x0130, 2);
    const AnalysisResult result = AnalysisOf(story);
    EXPECT_EQ(CountOf(result, "frame-lost"), 0U);
    // Only the same index once more tells a repetition from the next frame.
    const bool numbers = one.way.numbering.all.first != one.way.numbering.all.last;
    if (one.way.renumbers_repetitions || !numbers) continue;
    const auto unanswered = result.capture.frames.undecided[static_cast<std::size_t>(bus::Undecided::kNoAnswers)];
    EXPECT_GT(unanswered, 0U);
    EXPECT_EQ(unanswered + result.capture.frames.in_flight, result.capture.frames.outbound);
    EXPECT_EQ(CountOf(result, "capture-one-direction"), 0U);
  }
}

}  // namespace
}  // namespace ecaudit
