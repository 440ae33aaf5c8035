/// What the rules of the start-up share: each reports one kind of deviation from what is expected (--expect).
#pragma once

#include <string>
#include <vector>

#include "analyzers/compare/comparison.h"
#include "analyzers/judge/rule.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit {

class StartupRule : public Rule {
 public:
  explicit StartupRule(const RuleInfo& info) : Rule(info) {}
  void Finish() final;

 protected:
  /// True for the kinds that the rule reports.
  [[nodiscard]] virtual bool Reports(startup::Deviation::Kind kind) const = 0;
  /// Fills title, message and what else is particular; slave and frame are set.
  virtual void Describe(const startup::Deviation& deviation, Finding& finding) const = 0;

  /// Null for the bus.
  [[nodiscard]] const model::SlaveModel* Model(const startup::Deviation& deviation) const;
  /// "download of 6060h:0 Modes of operation".
  [[nodiscard]] std::string Noun(const startup::Deviation& deviation, const startup::ExpectedStep& step) const;
  [[nodiscard]] static std::string Noun(const StartupStep& step);
  /// "; SAFEOP refused with 0x001d ... in frame 760": what went wrong in the start-up itself; mostly empty.
  [[nodiscard]] std::string Refusal(const startup::Deviation& deviation, Finding& finding) const;
};

/// "slave 3 (Axis X)", as the expectation has it.
[[nodiscard]] std::string SlaveText(const startup::ExpectedSlave& slave);
/// "a, b, c and 4 more".
[[nodiscard]] std::string ListText(const std::vector<std::string>& texts);

}  // namespace ecaudit
