// What came of steps that nothing answered: given up by the master, or merely not in the capture.
#include "analyzers/collect/startup_outcomes.h"

#include <gtest/gtest.h>

namespace ecaudit::startup {
namespace {

constexpr TimeNs kMs = 1'000'000;

FrameRef Frame(FrameNo number, TimeNs time) {
  FrameRef frame;
  frame.number = number;
  frame.time = time;
  frame.has_time = true;
  return frame;
}

StartupStep Step(StartupKey::Kind kind, std::uint32_t address, const FrameRef& frame) {
  StartupStep step;
  step.key.kind = kind;
  step.key.address = address;
  step.frame = step.last = frame;
  step.outcome = StartupOutcome::kUnknown;
  return step;
}

/// A download of 6060h in frame 10; the master found nothing in `polls` looks up to `waited` later.
mailbox::MailboxUnanswered Silence(std::uint64_t polls, TimeNs waited) {
  mailbox::MailboxUnanswered event;
  event.request.frame = Frame(10, 0);
  event.request.index = std::uint16_t{0x6060};
  event.polls = polls;
  event.last_poll = Frame(20, waited);
  return event;
}

StartupOutcome OutcomeOf(const mailbox::MailboxUnanswered& event, bool goes_on = false) {
  std::vector<StartupStep> steps{Step(StartupKey::Kind::kDownload, 0x6060, Frame(10, 0))};
  if (goes_on) steps.push_back(Step(StartupKey::Kind::kRequest, 4, Frame(30, 800 * kMs)));
  MarkUnanswered(steps, event);
  return steps[0].outcome;
}

TEST(StartupOutcomeOf, ATransferThatTheMasterGaveUp) {
  using End = mailbox::MailboxUnanswered::End;
  mailbox::MailboxUnanswered event = Silence(100, 700 * kMs);
  EXPECT_EQ(OutcomeOf(event), StartupOutcome::kUnanswered) << "the next request came";
  event.end = End::kCaptureEnd;
  EXPECT_EQ(OutcomeOf(event), StartupOutcome::kUnknown) << "it may still come";
  EXPECT_EQ(OutcomeOf(event, true), StartupOutcome::kUnanswered) << "the master went on";
  event.last_poll = Frame(20, 1000 * kMs);
  EXPECT_EQ(OutcomeOf(event), StartupOutcome::kUnanswered) << "waited for long enough";
  event.end = End::kGap;
  EXPECT_EQ(OutcomeOf(event, true), StartupOutcome::kUnknown);
}

TEST(StartupOutcomeOf, ATransferWhoseAnswerTheCaptureMayMiss) {
  mailbox::MailboxUnanswered event = Silence(100, 700 * kMs);
  event.read_lost = true;
  EXPECT_EQ(OutcomeOf(event), StartupOutcome::kUnknown);
  event.read_lost = false;
  event.certainty = Certainty::kInferred;
  EXPECT_EQ(OutcomeOf(event), StartupOutcome::kUnknown);
  EXPECT_EQ(OutcomeOf(Silence(0, 700 * kMs)), StartupOutcome::kUnknown) << "nobody looked";
  EXPECT_EQ(OutcomeOf(Silence(100, 20 * kMs)), StartupOutcome::kUnknown) << "nobody waited";
  event = Silence(100, 700 * kMs);
  event.request.index = std::uint16_t{0x6061};
  EXPECT_EQ(OutcomeOf(event), StartupOutcome::kUnknown) << "another object";
}

TEST(StartupOutcomeOf, AStateTheMasterLooksForNoMore) {
  const auto stopped = [](std::uint64_t polls, TimeNs last_poll, TimeNs end) {
    return StoppedLooking({polls, Frame(1, 0), Frame(50, last_poll)}, Frame(100, end));
  };
  EXPECT_TRUE(stopped(1000, 3000 * kMs, 3300 * kMs));
  EXPECT_FALSE(stopped(1000, 3000 * kMs, 3100 * kMs)) << "the capture ends";
  EXPECT_FALSE(stopped(3, 3000 * kMs, 5000 * kMs)) << "it looks every second";
  EXPECT_FALSE(stopped(100, 100 * kMs, 3000 * kMs)) << "too short to have given up";
  EXPECT_FALSE(StoppedLooking({1000, FrameRef{}, FrameRef{}}, Frame(100, 5000 * kMs))) << "no time stamps";
}

TEST(StartupOutcomeOf, ADriveThatIsToBeEnabled) {
  const auto outcome = [](device::DriveState shows, TimeNs end) {
    std::vector<StartupStep> steps{Step(StartupKey::Kind::kDrive, 0x07, Frame(1, 0)),
                                   Step(StartupKey::Kind::kDrive, 0x0F, Frame(2, 0))};
    MarkDriveOutcome(steps, shows, Frame(100, end));
    EXPECT_EQ(steps[0].outcome, StartupOutcome::kUnknown) << "does not enable";
    return steps[1].outcome;
  };
  EXPECT_EQ(outcome(device::DriveState::kFault, 10 * kMs), StartupOutcome::kRefused);
  EXPECT_EQ(outcome(device::DriveState::kSwitchedOn, 10 * kMs), StartupOutcome::kUnknown);
  EXPECT_EQ(outcome(device::DriveState::kSwitchedOn, 1000 * kMs), StartupOutcome::kUnanswered);
}

}  // namespace
}  // namespace ecaudit::startup
