// What control and status words show alone, by the tables of CiA 402: bits 0 to 3 and 7 of the control word command,
// bits 0 to 3, 5 and 6 of the status word show the state.
#include "analyzers/model/drive_words.h"

#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::model {
namespace {

using device::DriveState;

const device::DriveProfile& Drive() {
  return *device::BuiltinProfile("generic")->drive;
}

FrameRef At(FrameNo number) {
  return {.number = number};
}

TEST(DriveControl, EachWordChangesWhatItsBitsMean) {
  struct Row {
    std::uint16_t word;
    bool acts;  // the AL state lets the drive act
    bool any, first, changed, activated;
    std::uint16_t motion;
    FrameNo since;
  };
  DriveControl control;
  control.SetFamily(Drive());
  FrameNo frame = 0;
  for (const Row& row : {
           Row{0x0006, false, true, true, false, false, 0, 1},      // the first one has no edges
           Row{0x0006, false, false, false, false, false, 0, 1},    // nothing is new
           Row{0x0006, true, true, false, false, true, 0, 3},       // the slave reaches OP
           Row{0x0007, true, true, false, true, false, 0, 4},       // Switch on
           Row{0x0017, true, false, false, false, false, 0x10, 4},  // a new set point commands no transition
           Row{0x0817, true, false, false, false, false, 0, 4},     // nor does a bit of the maker
           Row{0x090F, true, true, false, true, false, 0x110, 7},   // Enable operation with halt
       }) {
    SCOPED_TRACE(++frame);
    const DriveControl::News news = control.Take(row.word, At(frame), row.acts, false);
    EXPECT_EQ(news.any(), row.any);
    EXPECT_EQ(news.first, row.first);
    EXPECT_EQ(news.changed, row.changed);
    EXPECT_EQ(news.activated, row.activated);
    EXPECT_EQ(news.motion, row.motion);
    EXPECT_EQ(control.since.number, row.since);
  }
}

TEST(DriveStatus, ZeroBeforeAnyOtherWordShowsNothing) {
  DriveStatus status;
  status.SetFamily(Drive());
  EXPECT_FALSE(status.Take(0, At(1), false));
  status.Repeat(At(2));
  EXPECT_EQ(status.without_state.words, 0U);
  ASSERT_TRUE(status.Take(0x0250, At(3), false));  // Switch on disabled
  (void)status.Change(Drive().StateOf(0x0250), At(3), false);
  EXPECT_EQ(status.state, DriveState::kSwitchOnDisabled);
  EXPECT_TRUE(status.Take(0, At(4), false));  // now it is a word of the drive
}

TEST(DriveStatus, WordsWithoutStateLeaveTheStateBeforeThem) {
  DriveStatus status;
  status.SetFamily(Drive());
  ASSERT_TRUE(status.Take(0x0231, At(1), false));  // Ready to switch on
  (void)status.Change(Drive().StateOf(0x0231), At(1), false);
  status.Repeat(At(2));

  ASSERT_EQ(Drive().StateOf(0x0001), std::nullopt);
  ASSERT_TRUE(status.Take(0x0001, At(3), false));
  const DriveStateChanged lost = status.Change(std::nullopt, At(3), false);
  EXPECT_EQ(lost.from, DriveState::kReadyToSwitchOn);
  EXPECT_EQ(lost.from_last, 2U);
  EXPECT_EQ(lost.word_before, 0x0231);
  for (FrameNo frame = 3; frame <= 5; ++frame) status.Repeat(At(frame));
  EXPECT_EQ(status.without_state.words, 3U);
  EXPECT_EQ(status.without_state.first.number, 3U);
  EXPECT_EQ(status.without_state.last.number, 5U);

  ASSERT_TRUE(status.Take(0x0233, At(6), false));  // Switched on
  const DriveStateChanged found = status.Change(Drive().StateOf(0x0233), At(6), false);
  EXPECT_EQ(found.from, DriveState::kReadyToSwitchOn);
  EXPECT_EQ(found.from_last, 2U);
  EXPECT_EQ(status.state_since.number, 6U);
  status.Repeat(At(6));
  EXPECT_EQ(status.without_state.words, 3U);
}

}  // namespace
}  // namespace ecaudit::model
