/// What a working counter of a datagram with a logical address is measured by: one table.
#pragma once

#include <array>
#include <cstdint>

#include "decoder/base/evidence.h"

namespace ecaudit::wkc {

enum class CounterFact : std::uint8_t {
  kAllKnown,     ///< of every slave it is known whether it has a part in the datagram
  kBelow,        ///< the counter is below the least that the known slaves count
  kAbove,        ///< the counter is above the most that they count
  kOneValue,     ///< the states of the slaves leave one value
  kHeld,         ///< the known slaves have counted in full for a while
  kSetUpMissed,  ///< what set another FMMU may be missing from the capture, or never have returned
};
enum class CounterVerdict : std::uint8_t {
  kFits,
  kByHabit,       ///< what it was before is the expectation
  kByHabitOfAll,  ///< the same, of a sum of which some slaves may be missing by their states
  kNotEvaluable,
  kMismatch,
};

inline constexpr auto kCounters = [] {
  using F = CounterFact;
  using V = CounterVerdict;
  return std::to_array<EvidenceRow<F, V>>({
      // A slave that has an FMMU counts, whatever others have. Only the maximum is unknown.
      {{}, {F::kAllKnown, F::kBelow}, V::kByHabit},
      {{}, {F::kAllKnown, F::kHeld}, V::kByHabit},
      {{F::kAbove, F::kSetUpMissed}, {}, V::kNotEvaluable},
      {{}, {F::kBelow, F::kAbove, F::kOneValue}, V::kByHabitOfAll},
      {{}, {F::kBelow, F::kAbove}, V::kFits},
      {{}, {}, V::kMismatch},
  });
}();

}  // namespace ecaudit::wkc
