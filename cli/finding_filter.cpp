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

namespace {

FindingIndex PlaceOf(FindingIndex finding, const std::vector<FindingIndex>& places) {
  return finding < places.size() ? places[finding] : kNoFinding;
}

void MoveHolders(const std::vector<FindingIndex>& places, AnalysisResult& result) {
  const auto move = [&places](Ladder& ladder) {
    for (Rung& rung : ladder.rungs) rung.held_by = PlaceOf(rung.held_by, places);
  };
  for (SlaveSummary& slave : result.slaves) {
    move(slave.progress);
    for (AxisLadder& axis : slave.axes) move(axis.ladder);
  }
}

}  // namespace

void KeepFindings(const std::vector<bool>& wanted, AnalysisResult& result) {
  std::vector<FindingIndex> places(result.findings.size(), kNoFinding);
  std::vector<Finding> kept;
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    if (!wanted[i]) continue;
    places[i] = static_cast<FindingIndex>(kept.size());
    kept.push_back(std::move(result.findings[i]));
  }
  for (Finding& finding : kept) finding.caused_by = PlaceOf(finding.caused_by, places);
  const std::vector<FindingIndex> sorted = SortFindings(kept);
  for (FindingIndex& place : places) place = PlaceOf(place, sorted);
  result.findings = std::move(kept);
  MoveHolders(places, result);
}

}  // namespace ecaudit::cli
