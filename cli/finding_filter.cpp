#include "cli/finding_filter.h"

#include <cstddef>
#include <utility>

#include "analyzers/judge/finding_order.h"

namespace ecaudit::cli {

void AddCauses(const std::vector<Finding>& findings, std::vector<bool>& wanted) {
  std::vector<bool> followed(findings.size());
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!wanted[i]) continue;
    for (std::size_t at = i; at < findings.size() && !followed[at]; at = findings[at].caused_by) {
      followed[at] = true;
      wanted[at] = true;
    }
  }
}

void KeepFindings(const std::vector<bool>& wanted, std::vector<Finding>& findings) {
  std::vector<FindingIndex> new_index(findings.size(), kNoFinding);
  std::vector<Finding> kept;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!wanted[i]) continue;
    new_index[i] = static_cast<FindingIndex>(kept.size());
    kept.push_back(std::move(findings[i]));
  }
  for (Finding& finding : kept) {
    if (finding.caused_by < new_index.size()) finding.caused_by = new_index[finding.caused_by];
  }
  findings = std::move(kept);
  SortFindings(findings);
}

}  // namespace ecaudit::cli
