// Decisions of the mailbox rules that a trace shows badly: how long a wait has to be, and which findings a lost frame
// explains.
#include <gtest/gtest.h>

#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/mailbox_text.h"
#include "decoder/base/time.h"

namespace ecaudit {
namespace {

using mailbox::MailboxUnanswered;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kLimit = 1000 * kMs;

FrameRef At(FrameNo number, std::int64_t ms) {
  return {number, ms * kMs, true};
}

/// A request at 0 ms, `polls` polls, the last one at `last_ms`, ended by `end` at `end_ms`.
MailboxUnanswered Wait(std::uint64_t polls, std::int64_t last_ms, MailboxUnanswered::End end, std::int64_t end_ms) {
  MailboxUnanswered event;
  event.request.frame = event.since = At(1, 0);
  event.polls = polls;
  if (polls > 0) event.last_poll = At(10, last_ms);
  event.end = end;
  if (end != MailboxUnanswered::End::kCaptureEnd) event.ended = At(20, end_ms);
  return event;
}

TEST(MailboxWait, PastTheLimitIsUnansweredHoweverItEnds) {
  using End = MailboxUnanswered::End;
  for (const End end : {End::kNextRequest, End::kReset, End::kCaptureEnd, End::kGap}) {
    EXPECT_EQ(EvaluateWait(Wait(5, 1000, end, 1001), {}, kLimit), WaitVerdict::kUnanswered);
  }
  EXPECT_EQ(EvaluateWait(Wait(5, 999, End::kGap, 1001), {}, kLimit), WaitVerdict::kGap) << "what came later is missing";
}

TEST(MailboxWait, AMasterThatGivesUpHasWaitedHalfTheLimit) {
  using End = MailboxUnanswered::End;
  EXPECT_EQ(EvaluateWait(Wait(5, 500, End::kNextRequest, 501), {}, kLimit), WaitVerdict::kUnanswered);
  EXPECT_EQ(EvaluateWait(Wait(5, 700, End::kReset, 701), {}, kLimit), WaitVerdict::kUnanswered);
  EXPECT_EQ(EvaluateWait(Wait(5, 499, End::kNextRequest, 501), {}, kLimit), WaitVerdict::kTooShort);
  EXPECT_EQ(EvaluateWait(Wait(5, 499, End::kReset, 2000), {}, kLimit), WaitVerdict::kTooShort)
      << "only polls count: the answer may have waited in between";
}

TEST(MailboxWait, TheEndOfTheCaptureCountsOnlyIfItComesLate) {
  const MailboxUnanswered event = Wait(5, 700, MailboxUnanswered::End::kCaptureEnd, 0);
  EXPECT_EQ(EvaluateWait(event, At(50, 1699), kLimit), WaitVerdict::kTooShort);
  EXPECT_EQ(EvaluateWait(event, At(50, 1700), kLimit), WaitVerdict::kUnanswered);
  EXPECT_EQ(EvaluateWait(event, {}, kLimit), WaitVerdict::kTooShort);
}

TEST(MailboxWait, ARequestOfAnotherStateIsGivingUp) {
  using End = MailboxUnanswered::End;
  EXPECT_EQ(EvaluateWait(Wait(5, 700, End::kCaptureEnd, 0), At(50, 800), kLimit, true), WaitVerdict::kUnanswered);
  EXPECT_EQ(EvaluateWait(Wait(5, 499, End::kCaptureEnd, 0), At(50, 800), kLimit, true), WaitVerdict::kTooShort);
}

TEST(MailboxWait, NoFindingIfTheMasterNeverPolledOrTimeIsUnknown) {
  using End = MailboxUnanswered::End;
  EXPECT_EQ(EvaluateWait(Wait(0, 0, End::kNextRequest, 5000), {}, kLimit), WaitVerdict::kNeverPolled);
  MailboxUnanswered event = Wait(5, 2000, End::kNextRequest, 2001);
  event.since.has_time = false;
  EXPECT_EQ(EvaluateWait(event, {}, kLimit), WaitVerdict::kNoTime);
}

TEST(MailboxWait, ALostReadCountsAsAPoll) {
  MailboxUnanswered event = Wait(0, 0, MailboxUnanswered::End::kNextRequest, 700);
  event.read_lost = true;
  EXPECT_EQ(WaitOf(event), 700 * kMs);
  EXPECT_EQ(EvaluateWait(event, {}, kLimit), WaitVerdict::kUnanswered);
  event.ended = At(20, 2);
  EXPECT_EQ(EvaluateWait(event, {}, kLimit), WaitVerdict::kTooShort) << "the master repeated the request at once";
}

/// A clock that is set ahead or back between two polls: that time does not count.
TEST(MailboxWait, TheTimeByWhichTheClockWasSetDoesNotCount) {
  constexpr std::int64_t kHourMs = 3'600'000;
  FrameRef since = At(1, 0);
  FollowClock(since, At(5, 200), At(6, kHourMs + 210));
  EXPECT_EQ(since.time, (kHourMs + 10) * kMs);
  FollowClock(since, At(6, kHourMs + 210), At(7, 0));
  EXPECT_EQ(since.time, -200 * kMs);
  FollowClock(since, At(7, 0), At(8, 50'000));
  EXPECT_EQ(since.time, -200 * kMs) << "a master may be that slow";
}

Finding OddAt(SlaveId slave, FrameNo frame) {
  Finding finding;
  finding.slave = slave;
  finding.first = At(frame, 0);
  return finding;
}

TEST(DeferredFindings, ALostFrameInBetweenExplains) {
  DeferredFindings deferred;
  deferred.Add({10, 0, OddAt(0, 20)});
  deferred.Add({30, 0, OddAt(0, 40)});
  deferred.Add({10, 0, OddAt(1, 20)});
  deferred.Lost(0, 10);
  deferred.Lost(0, 20);
  deferred.Lost(0, 15);
  std::vector<FrameNo> left;
  deferred.SettleOld([&](DeferredFinding&& d) { left.push_back(d.finding.first.number); });
  EXPECT_TRUE(left.empty()) << "they may still be explained";
  deferred.SettleAll([&](DeferredFinding&& d) { left.push_back(d.finding.first.number + d.finding.slave); });
  EXPECT_EQ(left, (std::vector<FrameNo>{40, 21}));
}

TEST(DeferredFindings, TooManyAreSettledOldestFirst) {
  DeferredFindings deferred;
  std::vector<FrameNo> settled;
  for (FrameNo frame = 1; frame <= DeferredFindings::kMax + 2; ++frame) {
    deferred.Add({0, 0, OddAt(0, frame)});
    deferred.SettleOld([&](DeferredFinding&& d) { settled.push_back(d.finding.first.number); });
  }
  EXPECT_EQ(settled, (std::vector<FrameNo>{1, 2}));
}

}  // namespace
}  // namespace ecaudit
