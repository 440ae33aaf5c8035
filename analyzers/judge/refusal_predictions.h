/// Findings that say why a slave is to refuse a request, and what becomes of them when it answers.
#pragma once

#include <map>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"

namespace ecaudit {

/// The slave decides: a prediction that it contradicts by reaching the state is kept as info, since nothing was lost;
/// one that came true at least once keeps its severity.
class RefusalPredictions {
 public:
  /// `finding` predicts that `slave` refuses the request in frame `request`, and explains it.
  void Add(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding);
  /// Likewise, but too weak a reason to be named as the cause.
  void Watch(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding);
  void On(RuleContext& context, const model::AlAnswered& answer);

 private:
  struct Open {
    FrameNo request = 0;
    std::vector<FindingIndex> findings;
  };
  struct Told {
    Severity severity = Severity::kError;  ///< as reported
    bool refused = false;                  ///< the prediction came true
    bool accepted = false;
  };
  std::map<SlaveId, Open> open_;
  std::map<FindingIndex, Told> told_;
};

}  // namespace ecaudit
