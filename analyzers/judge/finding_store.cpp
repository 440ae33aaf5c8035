#include "analyzers/judge/finding_store.h"

#include <algorithm>
#include <utility>

#include "analyzers/result/every_slave.h"

namespace ecaudit {
namespace {

constexpr const char* kMoreThanListed = "more slaves or reasons than are listed one by one";

}  // namespace

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
  if (findings_.size() >= kMaxWithFirstOnes) return kNoFinding;
  finding.rule = rule.id;
  const auto setting = settings_.find(rule.id);
  finding.severity = setting != settings_.end() ? setting->second.severity : severity;
  if (!finding.last.seen()) finding.last = finding.first;
  if (finding.reference.document.empty()) finding.reference = ReferenceTo(rule.source);
  const auto index = static_cast<FindingIndex>(findings_.size());
  by_key_[Key{&rule, finding.slave, key}] = index;
  ++number;
  last = index;
  findings_.push_back(std::move(finding));
  return index;
}

void FindingStore::Regrade(FindingIndex index, Severity severity) {
  if (settings_.find(findings_[index].rule) == settings_.end()) findings_[index].severity = severity;
}

bool FindingStore::IsListed(const RuleInfo& rule, SlaveId slave, std::string_view reason) const {
  return std::any_of(not_evaluable_.begin(), not_evaluable_.end(), [&](const NotEvaluable& entry) {
    return entry.rule == rule.id && entry.slave == slave && entry.reason == reason;
  });
}

void FindingStore::AddNotEvaluable(const RuleInfo& rule, SlaveId slave, std::string reason, FrameNo frame) {
  if (IsOff(rule)) return;
  // Beyond the limit one entry for each rule stands for the rest: what is not listed must not look judged.
  if (not_evaluable_.size() >= kMaxNotEvaluable && !IsListed(rule, slave, reason)) {
    slave = kNoSlave;
    reason = kMoreThanListed;
  }
  for (NotEvaluable& entry : not_evaluable_) {
    if (entry.rule == rule.id && entry.slave == slave && entry.reason == reason) {
      ++entry.occasions;
      return;
    }
  }
  not_evaluable_.push_back({rule.id, slave, std::move(reason), frame, 1});
}

void FindingStore::Replace(SlaveId slave, SlaveId successor) {
  for (Finding& finding : findings_) {
    if (finding.slave == slave) finding.slave = successor;
  }
  std::erase_if(not_evaluable_, [&](const NotEvaluable& entry) { return entry.slave == slave; });
}

void FindingStore::FoldNotEvaluable(std::size_t slaves) {
  if (slaves < 2) return;
  std::vector<NotEvaluable> folded;
  for (NotEvaluable& entry : not_evaluable_) {
    const auto alike = [&](const NotEvaluable& other) {
      return other.rule == entry.rule && other.reason == entry.reason && other.slave != kNoSlave;
    };
    const auto first = std::find_if(not_evaluable_.begin(), not_evaluable_.end(), alike);
    const auto of_slaves = std::count_if(not_evaluable_.begin(), not_evaluable_.end(), alike);
    if (entry.slave == kNoSlave || static_cast<std::size_t>(of_slaves) < slaves) {
      folded.push_back(entry);
    } else if (&*first == &entry) {
      NotEvaluable all = entry;
      all.slave = kEverySlave;
      all.occasions = 0;
      for (const NotEvaluable& other : not_evaluable_) {
        if (alike(other)) all.occasions += other.occasions;
        if (alike(other) && other.first_frame < all.first_frame) all.first_frame = other.first_frame;
      }
      folded.push_back(std::move(all));
    }
  }
  not_evaluable_ = std::move(folded);
}

void AddRelated(Finding& finding, FrameNo frame) {
  if (frame == 0 || finding.related_frames.size() >= FindingStore::kMaxRelatedFrames) return;
  if (std::find(finding.related_frames.begin(), finding.related_frames.end(), frame) != finding.related_frames.end()) {
    return;
  }
  finding.related_frames.push_back(frame);
}

}  // namespace ecaudit
