/// Adds to findings what the settings of the drive, and the manual of its family, mean for them.
#pragma once

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"

namespace ecaudit {

/// Parameters whose rows in the family's profile name the rule, where the capture or the user gives their value; and
/// what the manual states of a word of the EEPROM that the finding is about.
void AddParameterNotes(const RuleContext& context, FindingStore& store);

}  // namespace ecaudit
