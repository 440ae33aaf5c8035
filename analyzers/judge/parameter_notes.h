/// Adds to findings what the settings of the drive mean for them.
#pragma once

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"

namespace ecaudit {

/// Parameters whose rows in the family's profile name the rule, where the capture or the user gives their value.
void AddParameterNotes(const RuleContext& context, FindingStore& store);

}  // namespace ecaudit
