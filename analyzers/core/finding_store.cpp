#include "analyzers/core/finding_store.h"

#include <algorithm>
#include <utility>

namespace ecaudit {

bool FindingStore::IsOff(const RuleInfo& rule) const {
  const auto setting = settings_.find(rule.id);
  return setting != settings_.end() && setting->second.off;
}

FindingIndex FindingStore::Repeat(const RuleInfo& rule, SlaveId slave, std::uint64_t key, const FrameRef& frame) {
  const auto found = by_key_.find(Key{&rule, slave, key});
  if (found == by_key_.end()) return kNoFinding;
  Finding& finding = findings_[found->second];
  ++finding.count;
  finding.last = frame;
  return found->second;
}

FindingIndex FindingStore::Add(const RuleInfo& rule, std::uint64_t key, Finding finding) {
  return Add(rule, key, rule.severity, std::move(finding));
}

FindingIndex FindingStore::Add(const RuleInfo& rule, std::uint64_t key, Severity severity, Finding finding) {
  if (IsOff(rule)) return kNoFinding;
  auto& [number, last] = per_rule_[{&rule, finding.slave}];
  if (number >= kMaxPerRuleAndSlave || (findings_.size() >= kMaxFindings && number > 0)) {
    Finding& folded = findings_[last];
    ++folded.count;
    folded.last = finding.first;
    return last;
  }
  if (findings_.size() >= kMaxFindings) return kNoFinding;
  finding.rule = rule.id;
  const auto setting = settings_.find(rule.id);
  finding.severity = setting != settings_.end() ? setting->second.severity : severity;
  if (!finding.last.seen()) finding.last = finding.first;
  if (finding.reference.document.empty()) {
    const std::size_t comma = rule.source.find(", ");
    finding.reference.document = std::string(rule.source.substr(0, comma));
    if (comma != std::string_view::npos) finding.reference.section = std::string(rule.source.substr(comma + 2));
  }
  const auto index = static_cast<FindingIndex>(findings_.size());
  by_key_[Key{&rule, finding.slave, key}] = index;
  ++number;
  last = index;
  findings_.push_back(std::move(finding));
  return index;
}

void FindingStore::AddNotEvaluable(const RuleInfo& rule, SlaveId slave, std::string reason, FrameNo frame) {
  if (IsOff(rule)) return;
  for (NotEvaluable& entry : not_evaluable_) {
    if (entry.rule == rule.id && entry.slave == slave && entry.reason == reason) {
      ++entry.occasions;
      return;
    }
  }
  if (not_evaluable_.size() >= kMaxNotEvaluable) return;
  not_evaluable_.push_back({rule.id, slave, std::move(reason), frame, 1});
}

void AddRelated(Finding& finding, FrameNo frame) {
  if (frame == 0 || finding.related_frames.size() >= FindingStore::kMaxRelatedFrames) return;
  if (std::find(finding.related_frames.begin(), finding.related_frames.end(), frame) != finding.related_frames.end()) {
    return;
  }
  finding.related_frames.push_back(frame);
}

}  // namespace ecaudit
