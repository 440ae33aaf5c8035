/// in: the findings of all rules.  out: which of them follows from another, where no rule could tell by itself.
///
/// Rules of different groups see one event each from its own side: eight frames are missing, the drive faults, and
/// sends an emergency. What joins them is a table of laws; a finding that has a cause keeps it.
#pragma once

namespace ecaudit {

class RuleContext;

/// After the last rule has finished.
void JoinConsequences(RuleContext& context);

}  // namespace ecaudit
