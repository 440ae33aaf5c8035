/// What the rules of the start-up share: each reports one kind of deviation from what is expected (--expect).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "analyzers/compare/comparison.h"
#include "analyzers/judge/rule.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/options/slave_names.h"

namespace ecaudit {

class StartupRule : public Rule {
 public:
  explicit StartupRule(const RuleInfo& info) : Rule(info) {}
  void Finish() final;

 protected:
  /// True for the kinds that the rule reports.
  [[nodiscard]] virtual bool Reports(startup::Deviation::Kind kind) const = 0;
  /// Sets the kind, arguments and what else is particular; slave and frame are set.
  virtual void Describe(const startup::Deviation& deviation, Finding& finding) const = 0;

  /// Null for the bus.
  [[nodiscard]] const model::SlaveModel* Model(const startup::Deviation& deviation) const;
  /// "download of 6060h:0 Modes of operation".
  [[nodiscard]] std::string Noun(const startup::Deviation& deviation, const startup::ExpectedStep& step) const;
  [[nodiscard]] static std::string Noun(const StartupStep& step);
  /// Adds the note about a state request that failed just before; mostly nothing.
  static void AddRefusal(const startup::Deviation& deviation, Finding& finding);
};

/// "slave 3 (Axis X)", as the expectation has it.
[[nodiscard]] std::string SlaveText(const startup::ExpectedSlave& slave, const SlaveNames& names);
/// Sets `name` to the first texts, and `name_more` to the number of others.
void SetSteps(Finding& finding, std::string_view name, std::string_view more, const std::vector<std::string>& texts);
[[nodiscard]] Value PhaseValue(StartupPhase phase);

/// Of StartupRule::AddRefusal().
inline constexpr NoteKind kRequestFailed{.name = "request-failed",
                                         .text = "Before that, the {step} was {outcome} ({at})."};

}  // namespace ecaudit
