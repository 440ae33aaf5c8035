/// in: the latch unit of a slave.  out: LatchSummary for the report.
#pragma once

#include <optional>

#include "analyzers/model/latch_unit.h"
#include "analyzers/result/latch_summary.h"

namespace ecaudit {

/// Unset when no latch word was seen.
[[nodiscard]] std::optional<LatchSummary> SummariseLatch(const model::LatchUnit& latch);

}  // namespace ecaudit
