#include "cli/copy/evidence_comments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/copy/frame_choice.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::cli {
namespace {

using test::Frame;
using test::MakeFinding;
using test::MakeSlave;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// f1 in frame 10, related to 8; f2 in frame 20, five times until 90, because of f1; f3 cites no frame.
AnalysisResult Three() {
  AnalysisResult result;
  result.slaves = {MakeSlave(5, 0, 0x1001, "drive")};
  result.findings = {MakeFinding("al-illegal-transition", Severity::kError, 5, 10),
                     MakeFinding("al-refused", Severity::kError, 5, 20, 0),
                     MakeFinding("capture-truncated", Severity::kInfo, kNoSlave, 1)};
  result.findings[0].related_frames = {8};
  result.findings[1].last = Frame(90);
  result.findings[1].count = 5;
  result.findings[1].reference = {"AKD-2011", "4.3.4"};
  result.findings[2].first = result.findings[2].last = {};
  return result;
}

TEST(EvidenceComments, NameTheFindingItsCauseAndTheFrame) {
  const FrameComments comments = CommentsOf(Three());
  ASSERT_EQ(comments.size(), 4U);
  EXPECT_THAT(comments.at(8),
              ElementsAre("frame 8: belongs to f1 error al-illegal-transition, slave 0 (drive, 0x1001): "
                          "title of al-illegal-transition (frame 10)"));
  ASSERT_EQ(comments.at(10).size(), 1U);
  EXPECT_EQ(comments.at(10)[0],
            "frame 10: f1 error al-illegal-transition, slave 0 (drive, 0x1001): title of al-illegal-transition\n"
            "message of al-illegal-transition");
  EXPECT_THAT(comments.at(20)[0], HasSubstr("\nConsequence of f1 error al-illegal-transition"));
  EXPECT_THAT(comments.at(20)[0], HasSubstr("(frame 10)\n5 times, last in frame 90\nSee AKD-2011, 4.3.4"));
  EXPECT_THAT(comments.at(90)[0], HasSubstr("frame 90: last of 5 times: f2 error al-refused"));
}

TEST(EvidenceComments, NamesOfTheCaptureCannotControlATerminal) {
  AnalysisResult result = Three();
  result.slaves[0].name = "\x1B[31mred";
  EXPECT_THAT(CommentsOf(result).at(10)[0], ::testing::Not(HasSubstr("\x1B")));
}

TEST(EvidenceComments, FramesOfAFindingAndOfItsCauses) {
  EXPECT_THAT(EvidenceFrames(Three(), 0), ElementsAre(8, 10));
  EXPECT_THAT(EvidenceFrames(Three(), 1), ElementsAre(8, 10, 20, 90));
  EXPECT_THAT(EvidenceFrames(Three(), 2), ElementsAre());
}

TEST(EvidenceComments, ACircleOfCausesEnds) {
  AnalysisResult result = Three();
  result.findings[0].caused_by = 1;
  EXPECT_THAT(EvidenceFrames(result, 0), ElementsAre(8, 10, 20, 90));
}

TEST(EvidenceComments, FindingsOfTheWholeFile) {
  EXPECT_EQ(FindingsWithoutFrame(Three()), "f3 info capture-truncated, bus: title of capture-truncated");
}

TEST(FindingsNamed, IdsAndRules) {
  const AnalysisResult result = Three();
  EXPECT_THAT(*FindingsNamed(result, {"f2", "f1", "f2"}), ElementsAre(0, 1));
  EXPECT_THAT(*FindingsNamed(result, {"al-refused"}), ElementsAre(1));
  EXPECT_EQ(FindingsNamed(result, {"f4"}).error().message, "there is no finding f4; the report has f1 to f3");
  EXPECT_EQ(FindingsNamed(result, {"f0"}).error().message, "there is no finding f0; the report has f1 to f3");
  EXPECT_EQ(FindingsNamed(result, {"al-timeout"}).error().message, "there is no finding of rule al-timeout");
  EXPECT_THAT(FindingsNamed(result, {"al-refusd"}).error().message, HasSubstr("did you mean 'al-refused'?"));
  EXPECT_EQ(FindingsNamed(AnalysisResult{}, {"f1"}).error().message, "there is no finding f1; the report has none");
}

std::vector<FrameNo> Chosen(FrameChoice choice) {
  std::vector<FrameNo> frames;
  for (FrameNo frame = 1; frame <= 20; ++frame) {
    if (choice.Contains(frame, static_cast<double>(frame))) frames.push_back(frame);
  }
  return frames;
}

TEST(FrameChoice, FramesWithTheirContext) {
  EXPECT_THAT(Chosen(FrameChoice({}, {10, 1}, 1)), ElementsAre(1, 2, 9, 10, 11));
  EXPECT_THAT(Chosen(FrameChoice({}, {4, 6, 7}, 1)), ElementsAre(3, 4, 5, 6, 7, 8));
  EXPECT_THAT(Chosen(FrameChoice({}, {}, 5)), ElementsAre());
  FrameRange range;
  range.from_s = 5;
  range.to_frame = 7;
  EXPECT_THAT(Chosen(FrameChoice(range, {4, 6, 7}, 1)), ElementsAre(5, 6, 7));
  EXPECT_THAT(Chosen(FrameChoice(range)), ElementsAre(5, 6, 7));
  EXPECT_EQ(FrameChoice(range).last(), 7U);
  EXPECT_EQ(FrameChoice({}, {4}, 2).last(), 6U);
  EXPECT_EQ(FrameChoice({}, {~FrameNo{0}}, 1'000'000'000).last(), ~FrameNo{0} - 1);
}

}  // namespace
}  // namespace ecaudit::cli
