#include "analyzers/judge/one_for_many.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <string_view>
#include <tuple>

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule.h"
#include "analyzers/options/slave_names.h"

namespace ecaudit {
namespace {

/// What happens at once is seen in each slave's own frames, one after the other.
constexpr FrameNo kFramesApart = 512;

using Group = std::vector<FindingIndex>;

/// Those of one group that may be one matter: each slave once, and without a common cause at about the same time.
std::vector<Group> Clusters(const std::vector<Finding>& findings, Group group, bool same_cause) {
  std::ranges::sort(group, [&](FindingIndex a, FindingIndex b) {
    return std::tuple(findings[a].first.number, a) < std::tuple(findings[b].first.number, b);
  });
  std::vector<Group> clusters;
  std::set<SlaveId> slaves;
  FrameNo last = 0;
  for (const FindingIndex index : group) {
    const Finding& finding = findings[index];
    const bool apart = !same_cause && finding.first.number > last + kFramesApart;
    if (clusters.empty() || apart || slaves.contains(finding.slave)) {
      clusters.emplace_back();
      slaves.clear();
    }
    clusters.back().push_back(index);
    slaves.insert(finding.slave);
    last = finding.first.number;
  }
  return clusters;
}

void Speak(Finding& first, const std::vector<Finding>& findings, const Group& all,
           const std::function<std::string(SlaveId)>& label, const std::function<SlavePos(SlaveId)>& position) {
  constexpr std::size_t kNamed = 8;
  std::set<unsigned> positions;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Finding& other = findings[all[i]];
    positions.insert(position(other.slave));
    if (i < kNamed) first.affected.named.push_back(label(other.slave));
    first.count = std::max(first.count, other.count);
    if (other.last.number > first.last.number) first.last = other.last;
    if (other.confidence == Confidence::kInferred) first.confidence = Confidence::kInferred;
    if (other.first.number != first.first.number) AddRelated(first, other.first.number);
  }
  first.affected.number = all.size();
  first.affected.first = label(first.slave);
  first.affected.positions = Ranges(positions);
  first.slave = kNoSlave;
}

}  // namespace

void JoinSlaves(std::vector<Finding>& findings, const std::function<std::string(SlaveId)>& label,
                const std::function<SlavePos(SlaveId)>& position) {
  if (findings.size() < kManySlaves) return;
  std::vector<FindingIndex> speaker(findings.size());
  std::iota(speaker.begin(), speaker.end(), FindingIndex{0});
  std::map<FindingIndex, Group> joined;
  // What follows from findings that are one is one, too: from the causes on to their consequences.
  constexpr int kSteps = 4;
  bool any = true;
  for (int step = 0; step < kSteps && any; ++step) {
    any = false;
    std::map<std::tuple<std::string_view, Severity, FindingIndex, std::string>, Group> groups;
    for (FindingIndex i = 0; i < findings.size(); ++i) {
      const Finding& f = findings[i];
      if (f.slave == kNoSlave || speaker[i] != i || joined.contains(i)) continue;
      const FindingIndex cause = f.caused_by < findings.size() ? speaker[f.caused_by] : kNoFinding;
      groups[{f.rule, f.severity, cause, IdentityOf(f)}].push_back(i);
    }
    for (const auto& [key, group] : groups) {
      if (group.size() < kManySlaves) continue;
      for (const Group& cluster : Clusters(findings, group, std::get<FindingIndex>(key) != kNoFinding)) {
        if (cluster.size() < kManySlaves) continue;
        any = true;
        for (const FindingIndex i : cluster) speaker[i] = cluster.front();
        joined[cluster.front()] = cluster;
      }
    }
  }
  if (joined.empty()) return;
  for (const auto& [first, all] : joined) {
    Finding speaks = findings[first];
    Speak(speaks, findings, all, label, position);
    findings[first] = std::move(speaks);
  }
  std::vector<FindingIndex> place(findings.size(), kNoFinding);
  std::vector<Finding> left;
  left.reserve(findings.size());
  for (FindingIndex i = 0; i < findings.size(); ++i) {
    if (speaker[i] != i) continue;
    place[i] = static_cast<FindingIndex>(left.size());
    left.push_back(std::move(findings[i]));
  }
  for (Finding& finding : left) {
    if (finding.caused_by < speaker.size()) finding.caused_by = place[speaker[finding.caused_by]];
  }
  findings = std::move(left);
}

}  // namespace ecaudit
