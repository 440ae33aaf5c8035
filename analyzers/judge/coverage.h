/// How far each rule could be evaluated, derived in one place: from what the rules themselves report as not evaluable,
/// and from what the capture shows of the slaves.
#pragma once

#include <vector>

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/coverage.h"
#include "analyzers/result/rule_info.h"

namespace ecaudit {

/// What a rule is about: its own subject, else that of its chapter.
[[nodiscard]] Subject SubjectOf(const RuleInfo& rule);

/// For all rules of the catalogue. To be called when all rules have finished, before lines are folded.
/// Where a rule was not evaluated and reported nothing (the capture shows nothing that it evaluates), the line that
/// reports this is added to the store.
[[nodiscard]] std::vector<RuleCoverage> CoverageOf(RuleContext& context, const AnalysisResult& result);

/// Why neither the AL state of the slave nor, in OP, its process data could be evaluated; empty when one of them was.
[[nodiscard]] std::optional<Reason> WhyNotEvaluated(const SlaveSummary& slave, const RuleContext& context,
                                                    const AnalysisResult& result);

}  // namespace ecaudit
