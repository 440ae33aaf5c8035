/// How far each rule could be judged, derived in one place: from what the rules themselves said they could not judge,
/// and from what the capture shows of the slaves.
#pragma once

#include <vector>

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/coverage.h"

namespace ecaudit {

/// For all rules of the catalogue. To be called when all rules have finished, before lines are folded.
/// Where a rule was not judged and said nothing (the capture shows nothing that it could have looked at), the line that
/// says so is added to the store.
[[nodiscard]] std::vector<RuleCoverage> CoverageOf(RuleContext& context, const AnalysisResult& result);

/// Why neither the AL state of the slave nor, in OP, its process data could be judged; empty when one of them was.
[[nodiscard]] std::optional<Reason> WhyNotEvaluated(const SlaveSummary& slave, const RuleContext& context,
                                                    const AnalysisResult& result);

}  // namespace ecaudit
