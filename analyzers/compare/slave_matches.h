/// Which slave of a capture is which expected one, or which one of another capture.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/expectation.h"

namespace ecaudit::startup {

/// By expected slave.
struct SlaveMatch {
  std::optional<std::size_t> place;  ///< in the capture; unset: there is none
  bool moved = false;                ///< it is on the other side of slaves that it should be before or after
};

/// By vendor and product, and by position among equal ones. A slave whose identity one side does not know matches by
/// position. The revision does not count: a device with another one is the same device.
[[nodiscard]] std::vector<SlaveMatch> MatchSlaves(std::span<const ExpectedSlave> expected,
                                                  std::span<const SlaveSummary> actual);

}  // namespace ecaudit::startup
