/// in: a working counter that is less than all, and the states that the slaves may be in.  out: whether all who have
/// inputs in the datagram gave them.
///
/// In SAFEOP a slave gives its inputs (1), in OP it takes its outputs, too (3 in LRW), below it does neither. 3 of 9 is
/// three slaves in SAFEOP as well as one in OP beside two that have left: where the master's outputs lie at the same
/// addresses, the inputs of those two are its own words coming back.
#pragma once

#include <cstdint>
#include <deque>

#include "analyzers/model/logical_expectation.h"

namespace ecaudit::model {

/// How many slaves a datagram has that may or must count.
struct Counting {
  unsigned inputs = 0;        ///< slaves that have inputs in it
  unsigned take = 0;          ///< slaves that may take outputs
  unsigned surely_take = 0;   ///< those in OP
  unsigned miss = 0;          ///< slaves with inputs that may count for nothing at all
  unsigned miss_nothing = 0;  ///< those of them that would not have taken outputs either
  unsigned step = 2;          ///< what taken outputs count: 2 in LRW
};

/// @return no way to come to `wkc` leaves out a slave's inputs; false also where nothing makes it up with all of them
[[nodiscard]] bool OnlyWithAllInputs(const Counting& counting, unsigned wkc);

/// Whether the counter is made up only so that all give their inputs: by slaves in the states they may be in, else,
/// where these do not explain it, by slaves of which any may be anywhere.
/// @param others  slaves with inputs, and with outputs, of which nothing but their place is known (ENI)
[[nodiscard]] bool AllInputsGiven(const LogicalExpectation& expectation, const std::deque<SlaveModel>& slaves,
                                  Counting others, unsigned wkc);

}  // namespace ecaudit::model
