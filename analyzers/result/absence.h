/// in: findings.  out: when a slave took no part in the bus, by what they report.
#pragma once

#include <vector>

#include "analyzers/result/analysis_result.h"

namespace ecaudit {

struct Absence {
  FrameRef from;
  FrameRef to;         ///< the last frame that shows it; not seen(): to the end of the capture
  bool whole = false;  ///< the slave does not answer at all; else it takes no part in the process data
  FindingIndex finding = kNoFinding;
};

/// In the order of the findings.
[[nodiscard]] std::vector<Absence> AbsencesOf(const SlaveSummary& slave, const AnalysisResult& result);

/// Whether a finding names which slaves a short working counter lacks: `slave`, which may be among them, or others.
/// False as well where none does.
[[nodiscard]] bool OthersAreMissing(const SlaveSummary& slave, const FrameRef& from, const FrameRef& to,
                                    const AnalysisResult& result);

}  // namespace ecaudit
