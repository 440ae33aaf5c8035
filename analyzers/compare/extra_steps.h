/// Steps that one start-up has beyond those of the other: what the other never does, and what it does less often.
#pragma once

#include <cstddef>
#include <vector>

#include "analyzers/result/startup_summary.h"

namespace ecaudit::diff {

/// A step that both do, one of them more often.
struct StepAgain {
  const StartupStep* step = nullptr;   ///< here
  const StartupStep* other = nullptr;  ///< there: with the same value if there is one, else the first
  std::size_t here = 0, there = 0;     ///< how often each start-up has the step with this value
  bool same_value = false;
  /// Where the values differ: the step with the other's value that is here as well; null where there is none.
  const StartupStep* as_there = nullptr;
};

struct ExtraSteps {
  std::vector<const StartupStep*> fresh;
  std::vector<StepAgain> again;  ///< each step with each value once
};

/// @param extra  steps of `here`, all three must outlive the result
[[nodiscard]] ExtraSteps SortOut(const std::vector<const StartupStep*>& extra, const StartupSummary& here,
                                 const StartupSummary& there);

}  // namespace ecaudit::diff
