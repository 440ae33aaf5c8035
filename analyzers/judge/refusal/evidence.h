/// What speaks for a setting as the reason of a refusal, and against it: a table for each question that has more than
/// one fact to it. The checks collect the facts, and write what the verdict calls for.
#pragma once

#include <array>
#include <cstdint>

#include "decoder/base/evidence.h"

namespace ecaudit::refusal {

// ----- the master wrote a sync manager while it was enabled: is that the reason?

enum class IgnoredFact : std::uint8_t {
  kNeedKnown,    ///< it is known what the slave needs
  kKeptFits,     ///< the settings that the ESC keeps are that
  kKeptShown,    ///< the capture shows that it kept them
  kWrittenFits,  ///< those that the master wrote are
};
enum class IgnoredVerdict : std::uint8_t { kNo, kMayBe, kYes };

inline constexpr auto kIgnoredWrites = [] {
  using F = IgnoredFact;
  using V = IgnoredVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      {{F::kNeedKnown, F::kKeptFits}, {}, V::kNo},
      // What was written is wrong, too, and explains the refusal itself.
      {{F::kNeedKnown}, {F::kKeptShown, F::kWrittenFits}, V::kNo},
      {{F::kNeedKnown, F::kKeptShown}, {}, V::kYes},
      {{}, {}, V::kMayBe},
  });
}();

// ----- do the outputs reach the slave, and does it give its inputs?

enum class ExchangeFact : std::uint8_t {
  kRequested,  ///< it refused a request; that they came to a slave which then left its state shows nothing
  kExchanged,  ///< working counters count them
  kMissed,     ///< working counters do not
  kNotSent,    ///< nothing that would carry them is in the capture, and nothing is missing from it
};
enum class ExchangeVerdict : std::uint8_t { kNothing, kRight, kNotCounted, kNotSent };

inline constexpr auto kExchanges = [] {
  using F = ExchangeFact;
  using V = ExchangeVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      {{F::kRequested, F::kExchanged}, {F::kMissed}, V::kRight},
      {{F::kExchanged}, {}, V::kNothing},
      {{F::kMissed}, {}, V::kNotCounted},
      {{F::kNotSent}, {}, V::kNotSent},
      {{}, {}, V::kNothing},
  });
}();

// ----- the code demands SYNC0: does it run?

enum class PulseFact : std::uint8_t {
  kNeverSet,       ///< the capture shows all of the set-up, and no write to 0x0981
  kKnown,          ///< 0x0981 as it was when the slave refused
  kRuns,           ///< SYNC0 is active
  kMayBeReason,    ///< it was set in time to be the reason
  kAnySync,        ///< the code speaks of any synchronisation: slaves without SYNC0 have it, too
  kShownAfter,     ///< that it is active is shown after the request only
  kWrittenActive,  ///< ... by the write that activated it: a read does not show since when
  kWasOff,         ///< ... and it is known to have been off before
};
enum class PulseVerdict : std::uint8_t { kNothing, kRight, kMayBeUnset, kMayBeOff, kOff, kMayBeLate, kLate };

inline constexpr auto kPulses = [] {
  using F = PulseFact;
  using V = PulseVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      {{F::kNeverSet}, {}, V::kMayBeUnset},
      {{}, {F::kKnown}, V::kNothing},
      {{F::kMayBeReason}, {F::kRuns, F::kAnySync}, V::kOff},
      {{F::kMayBeReason}, {F::kRuns}, V::kMayBeOff},
      {{}, {F::kRuns}, V::kNothing},
      {{}, {F::kShownAfter}, V::kRight},
      {{F::kWrittenActive, F::kWasOff}, {}, V::kLate},
      {{F::kWrittenActive}, {}, V::kMayBeLate},
      {{}, {}, V::kNothing},
  });
}();

// ----- does the cycle of the process data fit that of SYNC0?

enum class RateFact : std::uint8_t {
  kNoMultiple,    ///< neither is a multiple of the other, or the family needs one frame in each cycle
  kSame,          ///< one frame in each cycle
  kFaster,        ///< several frames in each cycle
  kSlower,        ///< several cycles for each frame
  kMayBeReason,   ///< the cycle was set in time to be the reason
  kNoTimeToShow,  ///< the slave did not run for long with it
  kSync1,         ///< SYNC1 is active: it may give one pulse for each frame
  kOtherReason,   ///< something else is wrong
};
enum class RateVerdict : std::uint8_t { kNothing, kRight, kDiffers, kSeveralFrames, kSeveralPulses };

inline constexpr auto kRates = [] {
  using F = RateFact;
  using V = RateVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      {{F::kNoMultiple, F::kMayBeReason}, {}, V::kDiffers},
      {{F::kNoMultiple}, {}, V::kNothing},
      {{F::kSame}, {}, V::kRight},
      // Several frames for one pulse are unusual: the slave uses one of them, and its code is about the cycle.
      {{F::kFaster, F::kMayBeReason}, {F::kOtherReason}, V::kSeveralFrames},
      // Some slaves want several pulses for each frame: that is for the slave to accept, and this one rejects it.
      {{F::kSlower, F::kNoTimeToShow}, {F::kSync1, F::kOtherReason}, V::kSeveralPulses},
      {{}, {}, V::kNothing},
  });
}();

}  // namespace ecaudit::refusal
