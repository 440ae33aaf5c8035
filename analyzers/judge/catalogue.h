/// The rules there are.
#pragma once

#include <string_view>
#include <vector>

#include "analyzers/result/rule_info.h"

namespace ecaudit {

/// All rules of the catalogue, sorted by id.
[[nodiscard]] const std::vector<const RuleInfo*>& RuleCatalogue();
/// Null when there is no such rule.
[[nodiscard]] const RuleInfo* FindRule(std::string_view id);

}  // namespace ecaudit
