/// Whether the capture misses frames between two of one sender: tables of evidence and verdict.
///
/// First the indices and repetitions are asked. Where they leave it open, the time between the two frames decides. A
/// return whose outbound copy the capture misses ("orphan") is itself evidence.
#pragma once

#include "decoder/base/evidence.h"

namespace ecaudit::bus {

enum class GapVerdict : std::uint8_t {
  kNone,
  kIndicesSkip,     ///< certain, by the indices: frames in flight may have returned unseen
  kCopyMissing,     ///< certain, by the outbound copy of a return: the same
  kLikelySkip,      ///< likely: the indices skip, for the first time lately; nothing else shows that frames are missing
  kMaySkip,         ///< possible: the same, of a master that has skipped numbers lately
  kNumbersSkip,     ///< the same, and at the rate of the sender there was no time for them
  kFewMayMiss,      ///< possible: a frame did not return, and the number of the next one is a little further
  kRoundMayMiss,    ///< possible: one round of indices fits between a frame and its repetition
  kAnotherCapture,  ///< possible: the clock jumps, another capture begins
  kSilence,         ///< possible: a silence that the master explains, frames in flight are not in doubt
  kSilenceInFlight,  ///< possible: a silence in which frames in flight may have returned unseen
  kAskTime,          ///< the indices leave it open
};

enum class IndexFact : std::uint8_t {
  kSkips,           ///< frames are missing by the index
  kFew,             ///< some numbers are left out, of a counter that is young or not that of this sort of frame
  kNext,            ///< the index is the next one, or the same after whole rounds
  kContinued,       ///< some counter was to have this index next, be it regular or not
  kOrphan,          ///< a return; both copies of it belong into the capture
  kAnyInFlight,     ///< a frame of the sender is in flight
  kTimeForSkipped,  ///< the skipped frames could be sent in the time between
  kTimeAtRate,      ///< also if they follow one another as those before did
  kLeftOutNone,     ///< the counter that skips has left out no number lately
  kLongPause,       ///< and the sender sent nothing for much longer than before
  kWhole,           ///< so far the capture holds both copies of all frames
  kOnlyOneFits,     ///< no more frames than this one fit into the time between
  kTimed,           ///< both frames have time stamps
  kSentAgain,       ///< the frame before once more, which had returned
  kTimeForRound,    ///< the master could use all its indices in the time between
  kTimeOut,         ///< the frame before once more, which had not returned, as masters do after a time-out
  kClockJumps,      ///< more than clocks of one capture go back or stand still
  kClockBack,       ///< the stamp is earlier
};

inline constexpr auto kGapByIndex = [] {
  using F = IndexFact;
  using V = GapVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      // Nearly always: the next number.
      {{F::kNext, F::kTimed}, {F::kOrphan, F::kSentAgain, F::kTimeOut, F::kClockBack}, V::kAskTime},
      // What was not sent cannot be missing: another program has a counter of its own, or the master skips numbers.
      {{F::kSkips}, {F::kOrphan, F::kAnyInFlight, F::kTimeForSkipped}, V::kNone},
      // Where packets are missing, one copy of a frame is there sooner or later without the other one.
      {{F::kSkips, F::kTimed, F::kWhole, F::kTimeAtRate, F::kLeftOutNone},
       {F::kOrphan, F::kAnyInFlight, F::kLongPause},
       V::kLikelySkip},
      {{F::kSkips, F::kTimed, F::kWhole, F::kTimeAtRate}, {F::kOrphan, F::kAnyInFlight, F::kLongPause}, V::kMaySkip},
      {{F::kSkips, F::kTimed, F::kWhole}, {F::kOrphan, F::kAnyInFlight, F::kLongPause}, V::kNumbersSkip},
      {{F::kSkips}, {}, V::kIndicesSkip},
      // A loss leaves out no number, a capture gap does.
      {{F::kFew, F::kAnyInFlight}, {F::kOrphan}, V::kFewMayMiss},
      // Where no number shows that it is the next one, more may be missing with its outbound copy.
      {{F::kOrphan}, {F::kContinued, F::kOnlyOneFits}, V::kCopyMissing},
      {{}, {F::kTimed}, V::kNone},
      {{F::kSentAgain, F::kTimeForRound}, {}, V::kRoundMayMiss},
      {{F::kSentAgain}, {}, V::kNone},
      {{F::kTimeOut}, {}, V::kNone},
      {{F::kClockJumps}, {F::kNext}, V::kAnotherCapture},
      // The numbers continue: only the clock was set.
      {{F::kClockBack}, {}, V::kNone},
      {{}, {}, V::kAskTime},
  });
}();

enum class TimeFact : std::uint8_t {
  kSilent,        ///< the sender sent nothing for much longer than before
  kOverdue,       ///< the index is the next one, and a frame is in flight for much longer than others
  kOrphan,        ///< as above
  kNext,          ///< as above
  kTimeForRound,  ///< the master could use all its indices in the time between, at the rate that fits the case
  kFewIndices,    ///< after whole rounds the next index may be a coincidence
  kLongSilence,   ///< longer than a master waits for a frame
};

inline constexpr auto kGapByTime = [] {
  using F = TimeFact;
  using V = GapVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      // A whole round of indices may be missing with the other copy. More likely only that one is.
      {{F::kOrphan, F::kNext, F::kTimeForRound, F::kFewIndices}, {}, V::kSilenceInFlight},
      {{}, {F::kSilent, F::kOverdue}, V::kNone},
      // If a return is missing as well, the master may have sent at its normal rate all the time.
      {{}, {F::kSilent, F::kTimeForRound}, V::kNone},
      {{F::kNext}, {F::kTimeForRound}, V::kNone},
      {{F::kNext}, {F::kFewIndices}, V::kNone},
      // A master that waits for a frame until its time-out is silent, too.
      {{F::kNext}, {F::kLongSilence}, V::kSilence},
      {{}, {}, V::kSilenceInFlight},
  });
}();

}  // namespace ecaudit::bus
