/// in: the findings of all rules.  out: which of them follows from another, where no rule can decide this by itself.
///
/// Rules of different groups see one event each from its own side: eight frames are missing, the drive faults, and
/// sends an emergency. What joins them is a table of laws; a finding that has a cause keeps it.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

namespace ecaudit {

class RuleContext;

/// After the last rule has finished.
void JoinConsequences(RuleContext& context);

/// Effect and cause of each law, as ids of rules.
[[nodiscard]] std::vector<std::pair<std::string_view, std::string_view>> CommonCauses();

}  // namespace ecaudit
