/// in: the ESI of a slave (--esi), the steps of its start-up.  out: each demand of the ESI, and whether it is met.
///
/// Settings count as they are at the end of the start-up, or at a failed request. Source: ETG.2000 (Sm, Fmmu, InitCmd,
/// OpMode, Slots, ESC, Timeout).
#pragma once

#include <limits>
#include <vector>

#include "analyzers/model/slave_model.h"
#include "analyzers/result/esi_demand.h"
#include "analyzers/result/startup_summary.h"

namespace ecaudit::startup {

/// The steps that set up one slave.
struct EsiEvidence {
  const StartupSummary& own;
  const StartupSummary& bus;  ///< what was sent to all slaves at once
  /// Frames may be missing from the capture: what is not seen may have been done.
  bool lossy = false;
  FrameNo until = std::numeric_limits<FrameNo>::max();  ///< what comes later does not count
};

/// Empty without an ESI. In the order in which they are due.
[[nodiscard]] std::vector<EsiDemand> EsiDemandsOf(const model::SlaveModel& slave, const EsiEvidence& evidence);

}  // namespace ecaudit::startup
