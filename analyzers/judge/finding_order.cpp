#include "analyzers/judge/finding_order.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace ecaudit {

void SortFindings(std::vector<Finding>& findings) {
  std::vector<FindingIndex> order(findings.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<FindingIndex>(i);
  const auto root = [&](FindingIndex i) {
    for (int depth = 0; depth < 16 && findings[i].caused_by != kNoFinding; ++depth) i = findings[i].caused_by;
    return i;
  };
  const auto depth_of = [&](FindingIndex i) {
    int depth = 0;
    while (depth < 16 && findings[i].caused_by != kNoFinding) {
      i = findings[i].caused_by;
      ++depth;
    }
    return depth;
  };
  std::stable_sort(order.begin(), order.end(), [&](FindingIndex a, FindingIndex b) {
    const FindingIndex ra = root(a);
    const FindingIndex rb = root(b);
    if (ra != rb) {
      return std::pair(findings[ra].first.number, ra) < std::pair(findings[rb].first.number, rb);
    }
    return std::tuple(depth_of(a), findings[a].first.number, a) < std::tuple(depth_of(b), findings[b].first.number, b);
  });
  std::vector<FindingIndex> new_index(findings.size());
  for (std::size_t i = 0; i < order.size(); ++i) new_index[order[i]] = static_cast<FindingIndex>(i);
  std::vector<Finding> sorted;
  sorted.reserve(findings.size());
  for (const FindingIndex i : order) {
    sorted.push_back(std::move(findings[i]));
    if (sorted.back().caused_by != kNoFinding) sorted.back().caused_by = new_index[sorted.back().caused_by];
  }
  findings = std::move(sorted);
}

}  // namespace ecaudit
