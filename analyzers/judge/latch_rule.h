/// What the rules of the chapter on latches share: each turns one kind of misuse that the latch unit saw into findings.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit {

/// "external latch 1 rising"; "the latch" where no edge is meant.
[[nodiscard]] std::string EdgeText(const model::LatchMisuse& misuse);
/// "in frame 12" or "by SDO in frame 12".
[[nodiscard]] std::string FrameText(const model::LatchMisuse& misuse);
/// " (armed in frame 12, valid since frame 40)", as far as it is known; else empty.
[[nodiscard]] std::string CaptureText(const model::LatchCapture& capture);

class LatchRule : public Rule {
 public:
  LatchRule(const RuleInfo& info, model::LatchMisuse::Kind kind) : Rule(info), kind_(kind) {
    Subscribe<model::LatchMisuse>(&LatchRule::On);
    Subscribe<model::LatchNotJudged>(&LatchRule::On);
  }

  void On(const model::LatchMisuse& misuse);
  void On(const model::LatchNotJudged& event);
  void Finish() override;

 protected:
  /// Title, message and evidence of the first occasion.
  virtual void Describe(const model::LatchMisuse& misuse, Finding& finding) const = 0;
  /// What tells one finding from another; the others are repetitions.
  [[nodiscard]] virtual std::uint64_t KeyOf(const model::LatchMisuse& misuse) const {
    return misuse.edge == nullptr ? 0 : misuse.edge->enable;
  }

 private:
  static constexpr std::size_t kMaxWords = 8;

  model::LatchMisuse::Kind kind_;
  std::map<FindingIndex, std::vector<std::uint16_t>> words_;  // control words of each finding, the first kMaxWords
};

}  // namespace ecaudit
