/// What the rules of the chapter on latches share: each turns one kind of misuse that the latch unit saw into findings.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit {

inline constexpr NoteKind kControlWords{"control-words", "Control words with this error: {words}."};
/// Notes of every latch rule.
inline constexpr const NoteKind* kLatchNotes[] = {&kControlWords};

class LatchRule : public Rule {
 public:
  LatchRule(const RuleInfo& info, model::LatchMisuse::Kind kind) : Rule(info), kind_(kind) {
    Subscribe<model::LatchMisuse>(&LatchRule::On);
    Subscribe<model::LatchNotEvaluable>(&LatchRule::On);
  }

  void On(const model::LatchMisuse& misuse);
  void On(const model::LatchNotEvaluable& event);
  void Finish() override;

 protected:
  /// The finding of the first occasion.
  [[nodiscard]] virtual Finding Describe(const model::LatchMisuse& misuse) const = 0;
  /// What distinguishes two findings; all others are repetitions.
  [[nodiscard]] virtual std::uint64_t KeyOf(const model::LatchMisuse& misuse) const {
    return misuse.edge == nullptr ? 0 : misuse.edge->enable;
  }
  /// Sets {edge}, {by_sdo}, {armed_frame} and {valid_frame}, where known.
  static void SetCapture(Finding& finding, const model::LatchMisuse& misuse);

 private:
  static constexpr std::size_t kMaxWords = 8;

  model::LatchMisuse::Kind kind_;
  std::map<FindingIndex, std::vector<std::uint16_t>> words_;  // control words of each finding, the first kMaxWords
};

}  // namespace ecaudit
