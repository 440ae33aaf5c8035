/// What a missing share is a consequence of: a slave that left the bus or its state.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/wkc/datagrams.h"
#include "analyzers/judge/wkc/episodes.h"
#include "analyzers/result/finding.h"

namespace ecaudit::wkc {

/// Frames between the first ones of both.
[[nodiscard]] FrameNo Distance(const Finding& a, const Finding& b);
/// A slave that does not answer any more at its own address.
[[nodiscard]] bool IsAway(const Finding& finding);
/// How many slaves are left; unset: the finding does not have it.
[[nodiscard]] std::optional<std::int64_t> SlavesNow(const Finding& changed);
/// Some slaves in the middle have left, not the last ones: a count does not show which.
[[nodiscard]] bool IsOfABranch(const Finding& changed);

/// Links `own` to its cause, if there is one among the findings.
void LinkCause(RuleContext& context, const Datagrams& datagrams, const Episodes& episodes, Finding& own);

}  // namespace ecaudit::wkc
