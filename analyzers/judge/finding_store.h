/// Collects findings while the analysis runs: folds repetitions, keeps the number bounded, applies the user's settings.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "analyzers/options/options.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/finding.h"
#include "analyzers/result/rule_info.h"

namespace ecaudit {

class FindingStore {
 public:
  // Of each severity by itself: no number of warnings takes the place of an error.

  /// Different findings of one rule and slave that are kept apart; later ones count on the last of them.
  static constexpr std::uint32_t kMaxPerRuleAndSlave = 50;
  /// Further ones count on the last of their rule and slave; where there is none, there is room for the first, ...
  static constexpr std::size_t kMaxFindings = 2500;
  /// ... and from here on they count on the last of their rule, whose first one always has room.
  static constexpr std::size_t kMaxWithFirstOnes = 5000;

  /// Lines that are kept while the analysis runs; further ones become one for each rule.
  static constexpr std::size_t kMaxNotEvaluable = 200'000;
  /// Different reasons of one rule that are kept.
  static constexpr std::size_t kMaxReasons = 200;
  /// Lines of a report. Beyond it those about the most slaves become one, and then the rest one for each rule.
  static constexpr std::size_t kMaxListed = 1000;
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

  void AddNotEvaluable(const RuleInfo& rule, SlaveId slave, const Reason& reason, FrameNo frame);
  /// What holds for each of the `slaves` of the bus (two or more) for the same reason becomes one entry for the bus.
  /// Nothing is added afterwards.
  void FoldNotEvaluable(std::size_t slaves);
  /// `slave` turned out to be `successor`: what was found of it is its successor's, what was not evaluated is listed
  /// of that one.
  void Replace(SlaveId slave, SlaveId successor);
  /// In the order in which they were added.
  [[nodiscard]] std::vector<NotEvaluable> not_evaluable() const;
  /// Calls `visit(rule, slave, first_frame, occasions)` for each, in no order.
  template <class Visit>
  void VisitNotEvaluable(Visit visit) const {
    for (const Group& group : groups_) {
      for (const Place& place : group.places) visit(group.rule, place.slave, place.first_frame, place.occasions);
    }
  }

  /// Findings that count on others because their rule and slave had kMaxPerRuleAndSlave, ...
  [[nodiscard]] std::uint64_t counted_on_slave() const { return counted_on_slave_; }
  /// ... or their severity kMaxFindings.
  [[nodiscard]] std::uint64_t findings_left_out() const { return findings_left_out_; }
  /// Lines about single slaves that became one for several of them.
  [[nodiscard]] std::uint64_t lines_left_out() const { return lines_left_out_; }

 private:
  using Key = std::tuple<const void*, SlaveId, std::uint64_t>;
  using OfRule = std::tuple<const void*, SlaveId, Severity>;
  /// Findings of one severity.
  struct Listed {
    std::uint32_t number = 0;
    FindingIndex last = kNoFinding;
  };
  /// One reason of one rule, ...
  struct Place {
    SlaveId slave = kNoSlave;
    std::uint32_t order = 0;  ///< of all lines
    FrameNo first_frame = 0;
    std::uint64_t occasions = 0;
  };
  struct Group {
    std::string_view rule;
    Reason reason;
    std::vector<Place> places;  ///< ... and for whom: by slave
  };

  FindingIndex CountOn(FindingIndex index, const Finding& finding);
  Group& GroupOf(std::string_view rule, const Reason& reason);
  void CutListed();

  const std::map<std::string, RuleSetting, std::less<>>& settings_;
  std::vector<Finding> findings_;
  std::map<Key, FindingIndex> by_key_;
  std::map<OfRule, Listed> per_slave_;
  std::map<std::pair<const void*, Severity>, Listed> per_rule_;
  std::array<std::size_t, 3> by_severity_{};
  std::uint64_t counted_on_slave_ = 0;
  std::uint64_t findings_left_out_ = 0;

  std::vector<Group> groups_;
  std::map<std::string_view, std::map<Reason, std::size_t>> group_of_;  // rule, reason: index
  std::size_t lines_ = 0;
  std::uint64_t lines_left_out_ = 0;
  std::optional<std::vector<NotEvaluable>> folded_;
};

/// Adds `frame` to the related frames unless it is 0, there already, or the list is full.
void AddRelated(Finding& finding, FrameNo frame);

}  // namespace ecaudit
