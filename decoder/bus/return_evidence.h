/// What a returned frame is: tables of evidence and verdict.
#pragma once

#include "decoder/base/evidence.h"

namespace ecaudit::bus {

enum class ReturnVerdict : std::uint8_t {
  kAnswers,          ///< the return of the frame in flight that fits
  kAnswersBoth,      ///< likewise, and the same frame sent again was taken to have returned before it: both did
  kCopyOfAnswer,     ///< the frame that fits is a packet captured twice, and so was its return
  kReachedOtherEnd,  ///< of a redundant line of which one port was captured: this port's frame arrived there
  kCapturedTwice,    ///< a second copy, by the capture
  kDuplicate,        ///< a second copy, by the line
  kUnmatched,        ///< a damaged return, or one whose outbound copy is not in the capture
};

enum class ReturnFact : std::uint8_t {
  kFits,           ///< a frame in flight has all that slaves never change
  kOvertaken,      ///< ... and frames sent later returned before
  kMayBeCopy,      ///< ... and is perhaps the packet before it, captured twice
  kOriginal,       ///< the same bytes returned a moment ago
  kOriginalLater,  ///< ... for a frame that was sent after the one that fits
  kWaitedFor,      ///< ... and after the master had waited for the one that fits
  kOtherPort,      ///< ... at another interface: a bridge, a mirror port, or a master that sends on what it got
  kMayBeNext,      ///< ... and without a number: the master had the time to send the same once more since then
  kNext,           ///< it has the index that its sender is to use next
  kFromOtherEnd,   ///< it comes from the end of a redundant line that was not captured, and no slave took part
};

inline constexpr auto kReturns = [] {
  using F = ReturnFact;
  using V = ReturnVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      // Nearly always.
      {{F::kFits}, {F::kOvertaken, F::kMayBeCopy}, V::kAnswers},
      {{F::kFromOtherEnd}, {F::kFits}, V::kReachedOtherEnd},
      {{F::kFits, F::kMayBeCopy, F::kOriginal}, {}, V::kCopyOfAnswer},
      {{F::kFits, F::kMayBeCopy}, {}, V::kAnswers},
      // A frame that was overtaken is nearly always lost. With few indices equal frames are sent again soon: what looks
      // like its return is another copy of a later frame that returned a moment ago.
      {{F::kFits, F::kNext}, {}, V::kAnswers},
      {{F::kFits}, {F::kOriginalLater}, V::kAnswers},
      // A late answer: the master sent the same once more after a time-out, and both came back.
      {{F::kFits, F::kWaitedFor}, {}, V::kAnswersBoth},
      // Nothing in flight fits. What the master was to send next is no second copy.
      {{F::kOriginal, F::kOtherPort}, {F::kNext}, V::kCapturedTwice},
      {{F::kOriginal}, {F::kNext, F::kMayBeNext}, V::kDuplicate},
      {{}, {}, V::kUnmatched},
  });
}();

/// Whether a return is a frame in flight that was altered on its way.
enum class AlteredFact : std::uint8_t {
  kAlike,        ///< a frame in flight is like it
  kFrameBefore,  ///< it has the index before that one, of no frame that is known: its own copy is missing
  kFrameAfter,   ///< it has the index after that one, which nothing has shown so far: likewise
  kLate,         ///< it comes much later than that one was to return
  kOneIndex,     ///< the master uses one index, which shows nothing
  kFewBits,      ///< they differ in no more bits than flip
  kSentBefore,   ///< a frame like it was sent just before
};

inline constexpr auto kAltered = [] {
  using F = AlteredFact;
  return std::to_array<EvidenceRow<F, bool>>({
      {{}, {F::kAlike}, false},
      {{F::kFrameBefore}, {}, false},
      {{F::kFrameAfter, F::kLate}, {}, false},
      {{F::kOneIndex}, {F::kFewBits}, false},
      {{F::kOneIndex, F::kSentBefore}, {}, false},
      {{}, {}, true},
  });
}();

/// Two equal frames are in flight, because the master repeated one, and one of them returns.
enum class OfTwo : std::uint8_t { kFirst, kSecond };

enum class OfTwoFact : std::uint8_t {
  kTimed,          ///< all three have time stamps
  kTripKnown,      ///< the usual round trip is known
  kFirstLong,      ///< no frame is in flight for as long as the first one, nor much longer than the second
  kFirstLate,      ///< the first one is late by the usual round trip
  kSecondHadTime,  ///< the second one had the time to return
  kSecondLate,     ///< the second one is late as well: something held all, and they return in order
};

inline constexpr auto kOfTwo = [] {
  using F = OfTwoFact;
  return std::to_array<EvidenceRow<F, OfTwo>>({
      {{}, {F::kTimed}, OfTwo::kFirst},
      {{F::kFirstLong}, {F::kTripKnown}, OfTwo::kSecond},
      {{}, {F::kTripKnown}, OfTwo::kFirst},
      {{F::kFirstLate, F::kSecondHadTime}, {F::kSecondLate}, OfTwo::kSecond},
      {{}, {}, OfTwo::kFirst},
  });
}();

}  // namespace ecaudit::bus
