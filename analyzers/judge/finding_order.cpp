#include "analyzers/judge/finding_order.h"

#include <utility>

#include "analyzers/result/reading_order.h"

namespace ecaudit {

void SortFindings(std::vector<Finding>& findings) {
  std::vector<ReadingNode> nodes;
  nodes.reserve(findings.size());
  for (const Finding& f : findings) nodes.push_back({f.severity, f.first.number, f.caused_by});
  std::vector<FindingIndex> new_index(findings.size());
  std::vector<Finding> sorted;
  sorted.reserve(findings.size());
  for (const ReadingEntry& entry : ReadingOrder(std::move(nodes))) {
    new_index[entry.index] = static_cast<FindingIndex>(sorted.size());
    sorted.push_back(std::move(findings[entry.index]));
  }
  for (Finding& finding : sorted) {
    if (finding.caused_by < new_index.size()) finding.caused_by = new_index[finding.caused_by];
  }
  findings = std::move(sorted);
}

}  // namespace ecaudit
