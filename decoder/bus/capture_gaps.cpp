#include "decoder/bus/capture_gaps.h"

#include <algorithm>
#include <utility>

#include "decoder/bus/frame_likeness.h"

namespace ecaudit::bus {

GapBefore CaptureGaps::Follow(std::uint8_t number, const wire::FrameView& frame, Repeats repeats,
                              bool orphan) noexcept {
  SendingRhythm& rhythm = context_.senders[number].rhythm;
  const IndexSequence::Step step = rhythm.indices.Follow(frame, repeats != Repeats::kNo);
  const FrameRef last = std::exchange(rhythm.last, frame.ref());
  const bool timed = AreTimed(last, frame.ref());
  const std::int64_t apart = timed ? Elapsed(last, frame.ref()) : 0;
  // A master that was started again begins where its counter restarts, too.
  const bool began = apart > threshold::kSilentNs && rhythm.indices.restarts();
  if (rhythm.indices.loose() || began) context_.statistics.last_loose = frame.ref().number;
  if (timed) rhythm.CompareStamps(apart);
  const bool skips = step == IndexSequence::Step::kBroken;
  const bool leaves_out_few = step == IndexSequence::Step::kFew;
  const bool next = step == IndexSequence::Step::kNext;
  const bool repeats_unanswered = repeats == Repeats::kAll && !skips && timed && context_.trip.HasWaited(apart);
  if (repeats_unanswered) ++context_.statistics.repeated_unanswered;

  Facts<IndexFact> index{};
  index.Set(IndexFact::kSkips, skips);
  index.Set(IndexFact::kFew, leaves_out_few);
  index.Set(IndexFact::kNext, next);
  index.Set(IndexFact::kOrphan, orphan);
  index.Set(IndexFact::kTimed, timed);
  index.Set(IndexFact::kSentAgain, repeats == Repeats::kAnswered);
  index.Set(IndexFact::kClockBack, apart < 0);
  if (!next || orphan || repeats != Repeats::kNo) {
    const bool cyclic = !frame.empty() && wire::IsLogical(frame[0].command());
    const bool retries = rhythm.indices.IsNumbered(frame) || (apart <= threshold::kRetryNs && !cyclic);
    index.Set(IndexFact::kContinued, rhythm.indices.continued());
    index.Set(IndexFact::kAnyInFlight, (skips || leaves_out_few) && context_.sent.AnyOpen([&](const SentFrame& sent) {
      return sent.sender == number && !sent.may_be_copy();
    }));
    // Where they are missing before the frame before, the time between these two shows nothing.
    const bool earlier = skips && rhythm.indices.broke_earlier();
    index.Set(IndexFact::kTimeForSkipped,
              earlier || (skips && rhythm.HasTimeForSkipped(last, frame.ref(), context_.trip)));
    index.Set(IndexFact::kTimeAtRate, earlier || (skips && rhythm.HasTimeAtRate(apart)));
    index.Set(IndexFact::kLeftOutNone, skips && rhythm.indices.left_out_none());
    index.Set(IndexFact::kLongPause, skips && timed && rhythm.TakeDistance(apart));
    index.Set(IndexFact::kWhole, context_.statistics.unmatched_returned == 0 && context_.statistics.lost == 0);
    index.Set(IndexFact::kOnlyOneFits, orphan && rhythm.OnlyOneFits(last, frame.ref()));
    index.Set(IndexFact::kTimeForRound, repeats == Repeats::kAnswered && rhythm.IndicesThatMayBeMissing(apart) > 0);
    index.Set(IndexFact::kTimeOut, repeats_unanswered && retries);
    index.Set(IndexFact::kClockJumps, timed && ClockJumps(last.time, frame.ref().time));
  }
  GapVerdict verdict = Decide(kGapByIndex, index);
  if (verdict == GapVerdict::kAskTime) {
    const bool few = rhythm.indices.span() < threshold::kNoCoincidenceIndices;
    const bool silent = rhythm.TakeDistance(apart);
    const bool overdue = next && few && AnyOverdue(number, frame.ref());
    if (!silent && !overdue && !orphan) return GapBefore::kNone;  // nearly always: no need to measure
    const bool fast = overdue || (silent && orphan);
    const std::int64_t distance = std::max<std::int64_t>(fast ? rhythm.shortest_ns() : rhythm.mean_ns(), 1);
    Facts<TimeFact> time{};
    time.Set(TimeFact::kSilent, silent);
    time.Set(TimeFact::kOverdue, overdue);
    time.Set(TimeFact::kOrphan, orphan);
    time.Set(TimeFact::kNext, next);
    time.Set(TimeFact::kTimeForRound, apart / distance + 1 >= rhythm.indices.span());
    time.Set(TimeFact::kFewIndices, few);
    time.Set(TimeFact::kLongSilence, apart > threshold::kSilentNs);
    verdict = Decide(kGapByTime, time);
  }
  if (verdict == GapVerdict::kNone) return GapBefore::kNone;
  const bool whole = context_.statistics.unmatched_returned == 0 && context_.statistics.lost == 0;
  const bool matched = whole && context_.senders[number].answered() &&
                       !context_.sent.AnyOpen([&](const SentFrame& sent) { return sent.sender == number; });
  return Apply(verdict, number, frame.ref(),
               next && !orphan && matched && rhythm.indices.span() >= threshold::kRoundIndices);
}

GapBefore CaptureGaps::Apply(GapVerdict verdict, std::uint8_t number, const FrameRef& at, bool rounds) noexcept {
  switch (verdict) {
    case GapVerdict::kNone:
    case GapVerdict::kAskTime:
      return GapBefore::kNone;
    case GapVerdict::kIndicesSkip:
      context_.statistics.CountGap(at);
      [[fallthrough]];
    case GapVerdict::kCopyMissing:
      OnGap(number);
      return GapBefore::kCertain;
    case GapVerdict::kFewMayMiss:
    case GapVerdict::kRoundMayMiss:
      DoubtInFlight(number, Undecided::kCaptureGap);
      break;
    case GapVerdict::kAnotherCapture:
      DoubtInFlight(number, Undecided::kSecondCapture);
      break;
    case GapVerdict::kSilenceInFlight:
      DoubtInFlight(number, Undecided::kSilence);
      return rounds ? GapBefore::kRounds : GapBefore::kPossible;
    case GapVerdict::kLikelySkip:
      context_.statistics.CountSkip(at);
      ++context_.statistics.likely_skips;
      return GapBefore::kLikelySkip;
    case GapVerdict::kMaySkip:
      context_.statistics.CountSkip(at);
      return GapBefore::kSkip;
    case GapVerdict::kNumbersSkip:
      return GapBefore::kSkip;
    case GapVerdict::kSilence:
      return rounds ? GapBefore::kRounds : GapBefore::kPossible;
  }
  return GapBefore::kPossible;
}

void CaptureGaps::FollowSent(std::uint8_t number, const wire::FrameView& frame, Repeats repeats) noexcept {
  const GapBefore gap = Follow(number, frame, repeats);
  if (gap == GapBefore::kNone) return;
  open_ = std::max(open_, gap);
  after_ = context_.sent.end();
}

/// True when a frame has been in flight for much longer than others take.
bool CaptureGaps::AnyOverdue(std::uint8_t number, const FrameRef& now) noexcept {
  if (!context_.trip.known() || !now.has_time) return false;
  return context_.sent.AnyOpen([&](const SentFrame& sent) {
    return sent.sender == number && sent.overtaken == 0 && !sent.may_be_copy() && sent.ref().has_time &&
           context_.trip.IsLate(Elapsed(sent.ref(), now));
  });
}

/// What is in flight may have returned unseen. What was overtaken more than once before had its time (a frame without
/// number may stand between it and the one that shows the capture gap).
void CaptureGaps::DoubtInFlight(std::uint8_t number, Undecided reason) noexcept {
  context_.sent.EachOpenOf(number, context_.sent.end(), [&](SentFrame& sent) {
    if (sent.overtaken <= 1) sent.Doubt(reason);
  });
}

void CaptureGaps::OnGap(std::uint8_t number) noexcept {
  DoubtInFlight(number, Undecided::kCaptureGap);
  context_.sent.EachOpenOf(number, context_.sent.end(), [&](SentFrame& sent) {
    if (sent.overtaken > 0 || sent.may_be_copy()) return;
    sent.overtaken = 1;  // a frame after the capture gap with the same index comes first
    sent.before_gap = true;
    context_.sink.OnDoubtful(sent.view);
  });
}

GapBefore CaptureGaps::Take(std::uint64_t sequence) noexcept {
  return open_ == GapBefore::kNone || sequence < after_ ? GapBefore::kNone : std::exchange(open_, GapBefore::kNone);
}

GapBefore CaptureGaps::Before(const wire::FrameView& orphan) noexcept {
  const std::uint8_t number = context_.senders.IndexOf(orphan, context_.directions);
  const Sender& sender = context_.senders[number];
  std::uint64_t open = 0;
  context_.sent.EachOpenOf(number, context_.sent.end(), [&](const SentFrame&) { ++open; });
  const auto has_its_number = [&](const SentFrame& sent) {
    return sent.sender == number && SameFirstIndex(sent.view, orphan);
  };
  // Frames sent later may be in flight already: then it only looks as if it came from before. The capture gap that one
  // of them showed lies before this one. Not where the frame that had its number is known.
  if (open > 0 && sender.rhythm.indices.IsAfter(orphan, open) &&
      context_.sent.NewestRecent(context_.sent.end(), has_its_number) == nullptr) {
    const GapBefore gap = Take(context_.sent.end());
    // Here is the copy without the other one.
    return gap == GapBefore::kSkip || gap == GapBefore::kLikelySkip
               ? Apply(GapVerdict::kIndicesSkip, number, orphan.ref())
               : gap;
  }
  const GapBefore gap = Follow(number, orphan, Repeats::kNo, BelongsIntoCapture(sender, orphan));
  return std::max(gap, Take(context_.sent.end()));
}

/// What returns was sent. Where both copies of what this master sends are captured, and in the order in which they
/// were on the wire, the capture misses the other one, and perhaps more with it.
bool CaptureGaps::BelongsIntoCapture(const Sender& sender, const wire::FrameView& orphan) const noexcept {
  if (sender.returns < Returns::kPairs || sender.own_return_port || context_.returns_early) return false;
  if (context_.any_cut || context_.unreadable) return false;
  const DirectionLearner& directions = context_.directions;
  if (directions.returns_stamped_first() || directions.HasOnePort() || directions.IsOtherEnd(orphan)) return false;
  return !AnyCirculating(orphan);
}

/// Who begins with a command to all slaves when nothing is in flight sets the bus up: another program was started. Else
/// another capture was appended.
GapBefore CaptureGaps::AppearsLate(const Sender& master, const wire::FrameView* sent, const FrameRef& at) noexcept {
  if (master.answered() || context_.statistics.paired < threshold::kLateMasterPairs) return GapBefore::kNone;
  const bool others_wait = context_.sent.AnyOpen([&](const SentFrame& frame) {
    const Sender& other = context_.SenderOfSent(frame);
    return &other != &master && other.answered();
  });
  if (sent != nullptr && IsBroadcastOnly(*sent) && !others_wait) return GapBefore::kPossible;
  context_.statistics.CountGap(at);
  for (std::uint8_t other = 0; other < context_.senders.size(); ++other) {
    if (context_.senders[other].answered()) DoubtInFlight(other, Undecided::kSecondCapture);
  }
  return GapBefore::kCertain;
}

}  // namespace ecaudit::bus
