#include "analyzers/judge/finding_order.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "analyzers/result/reading_order.h"

namespace ecaudit {

namespace {

/// Puts the finding at order[i] into place i, and causes with them.
/// @return the inverse of `order`
std::vector<FindingIndex> Reorder(std::vector<Finding>& findings, const std::vector<std::size_t>& order) {
  std::vector<FindingIndex> new_index(findings.size());
  std::vector<Finding> sorted;
  sorted.reserve(findings.size());
  for (const std::size_t index : order) {
    new_index[index] = static_cast<FindingIndex>(sorted.size());
    sorted.push_back(std::move(findings[index]));
  }
  for (Finding& finding : sorted) {
    if (finding.caused_by < new_index.size()) finding.caused_by = new_index[finding.caused_by];
  }
  findings = std::move(sorted);
  return new_index;
}

}  // namespace

std::vector<FindingIndex> SortFindings(std::vector<Finding>& findings) {
  // What happens in one frame stands by rule, not by who noticed first.
  std::vector<std::size_t> by_rule(findings.size());
  std::iota(by_rule.begin(), by_rule.end(), std::size_t{0});
  std::ranges::stable_sort(by_rule, [&](std::size_t a, std::size_t b) {
    const Finding &x = findings[a], &y = findings[b];
    return std::tuple(x.first.number, x.rule, x.slave) < std::tuple(y.first.number, y.rule, y.slave);
  });
  const std::vector<FindingIndex> place_by_rule = Reorder(findings, by_rule);

  std::vector<ReadingNode> nodes;
  nodes.reserve(findings.size());
  for (const Finding& f : findings) {
    nodes.push_back({.severity = f.severity, .frame = f.first.number, .caused_by = f.caused_by, .aside = f.aside});
  }
  std::vector<std::size_t> as_read;
  for (const ReadingEntry& entry : ReadingOrder(std::move(nodes))) as_read.push_back(entry.index);
  const std::vector<FindingIndex> place_as_read = Reorder(findings, as_read);
  std::vector<FindingIndex> place;
  place.reserve(place_by_rule.size());
  for (const FindingIndex index : place_by_rule) place.push_back(place_as_read[index]);
  return place;
}

void NumberFindings(std::vector<Finding>& findings) {
  std::uint32_t number = 0;
  for (Finding& finding : findings) finding.number = ++number;
}

}  // namespace ecaudit
