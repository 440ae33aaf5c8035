/// Adds to findings what the slave states itself in its diagnosis history (10F3h).
#pragma once

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"

namespace ecaudit {

/// Messages about faults, refused and lost states: those that the master read after them, and those with the error code
/// of an emergency.
void AddDiagnosisNotes(const RuleContext& context, FindingStore& store);

}  // namespace ecaudit
