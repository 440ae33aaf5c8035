/// Collects findings while the analysis runs: folds repetitions, keeps the number bounded, applies the user's settings.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "analyzers/options/options.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/finding.h"
#include "analyzers/result/rule_info.h"

namespace ecaudit {

class FindingStore {
 public:
  /// Different findings of one rule and slave that are kept apart; later ones count on the last of them.
  static constexpr std::uint32_t kMaxPerRuleAndSlave = 50;
  /// Further ones count on the last of their rule and slave; where there is none, there is room for the first.
  static constexpr std::size_t kMaxFindings = 2500;
  static constexpr std::size_t kMaxWithFirstOnes = 5000;
  /// Beyond it, one for each rule.
  static constexpr std::size_t kMaxNotEvaluable = 1000;
  static constexpr std::size_t kMaxRelatedFrames = 16;

  explicit FindingStore(const std::map<std::string, RuleSetting, std::less<>>& settings) : settings_(settings) {}

  /// True when the user switched the rule off.
  [[nodiscard]] bool IsOff(const RuleInfo& rule) const;

  /// Counts a repetition of what was reported under (rule, slave, key) before.
  /// @return its index, kNoFinding when there is none yet: then call Add(). Nothing is allocated.
  FindingIndex Repeat(const RuleInfo& rule, SlaveId slave, std::uint64_t key, const FrameRef& frame);
  /// Adds a finding under (rule, slave, key). `finding.rule`, severity and reference are filled in from the rule where
  /// they are not set.
  FindingIndex Add(const RuleInfo& rule, std::uint64_t key, Finding finding);
  /// As Add(), with a severity other than the rule's default; the user's setting still wins.
  FindingIndex Add(const RuleInfo& rule, std::uint64_t key, Severity severity, Finding finding);

  /// Gives a finding another severity once more is known; the user's setting still wins.
  void Regrade(FindingIndex index, Severity severity);

  [[nodiscard]] Finding& operator[](FindingIndex index) { return findings_[index]; }
  [[nodiscard]] const std::vector<Finding>& findings() const { return findings_; }
  [[nodiscard]] std::vector<Finding>& findings() { return findings_; }

  void AddNotEvaluable(const RuleInfo& rule, SlaveId slave, std::string reason, FrameNo frame);
  /// What holds for each of the `slaves` of the bus (two or more) for the same reason becomes one entry for the bus.
  void FoldNotEvaluable(std::size_t slaves);
  /// `slave` turned out to be `successor`: what was found of it is its successor's, what was not judged of it is told of
  /// that one.
  void Replace(SlaveId slave, SlaveId successor);
  [[nodiscard]] const std::vector<NotEvaluable>& not_evaluable() const { return not_evaluable_; }

 private:
  [[nodiscard]] bool IsListed(const RuleInfo& rule, SlaveId slave, std::string_view reason) const;

  using Key = std::tuple<const void*, SlaveId, std::uint64_t>;

  const std::map<std::string, RuleSetting, std::less<>>& settings_;
  std::vector<Finding> findings_;
  std::map<Key, FindingIndex> by_key_;
  std::map<std::pair<const void*, SlaveId>, std::pair<std::uint32_t, FindingIndex>> per_rule_;  // number, last
  std::vector<NotEvaluable> not_evaluable_;
};

/// Adds `frame` to the related frames unless it is 0, there already, or the list is full.
void AddRelated(Finding& finding, FrameNo frame);

}  // namespace ecaudit
