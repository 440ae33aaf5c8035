/// What the catalogue knows of a rule; `ecaudit rules`, `ecaudit explain`, docs/rules.md and reports print it.
#pragma once

#include <string_view>

#include "analyzers/result/finding.h"

namespace ecaudit {

struct RuleInfo {
  std::string_view id;     ///< the name in the catalogue; never reused
  std::string_view group;  ///< "AL state machine", as the catalogue's headings
  Severity severity;       ///< default; where a rule has two, the higher
  /// What it finds stands in the frames that it cites: packets that the capture misses do not explain it.
  bool needs_no_history = false;
  std::string_view title;   ///< one line, present tense, no full stop
  std::string_view needs;   ///< what must be known before it can be judged
  std::string_view source;  ///< document and section it rests on
  /// Markdown with the headings What it checks, Why it matters, How it is decided, Example, What to do
  std::string_view doc;
};

}  // namespace ecaudit
