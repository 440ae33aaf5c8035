// Looks into sentences, each time in another way. Never compiled; no_text_search.py has to name each line.
#include "analyzers/result/finding.h"

bool Reads(const Finding& finding, const NotEvaluable& entry) {
  if (finding.title.find("of the outputs") != std::string::npos) return true;
  if (finding.message.substr(0, 3) == "The") return true;
  if (entry.reason == "no returned frames") return true;
  return TitleOf(finding).starts_with("SAFEOP");
}
