/// Adds to findings about PDO mappings what the master wanted, what the slave accepted, and where each entry lies.
#pragma once

#include "analyzers/collect/mapping_history.h"
#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"

namespace ecaudit {

/// One table for each configuration and direction in which something went wrong: of several findings about it, the
/// first cause has it. To be called when consequences have their causes.
void AddMappingTables(const RuleContext& context, const MappingHistory& history, FindingStore& store);

}  // namespace ecaudit
