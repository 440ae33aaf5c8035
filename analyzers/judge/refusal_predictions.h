/// Findings that give a reason why a slave has to refuse a request, and their severity after its answer.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"

namespace ecaudit {

/// The slave decides. If it reaches the state, the finding becomes an info: nothing was lost. If it refused at least
/// once, the finding keeps its severity.
class RefusalPredictions {
 public:
  /// What a slave without a processor shows by reaching the state: it echoes every state.
  enum class Echo : std::uint8_t {
    kShowsNothing,
    kCounts  ///< its own EEPROM has the setting
  };
  /// `finding` predicts that `slave` refuses the request in frame `request`, and explains it.
  void Add(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding, Echo echo = Echo::kShowsNothing);
  /// Likewise, but the reason is too weak to be the cause of the refusal.
  void Watch(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding);
  void On(RuleContext& context, const model::AlAnswered& answer);

 private:
  struct Open {
    FrameNo request = 0;
    std::vector<FindingIndex> findings;
  };
  struct Reported {
    Severity severity = Severity::kError;  ///< as reported
    bool refused = false;                  ///< the prediction came true
    bool accepted = false;
    Echo echo = Echo::kShowsNothing;
  };
  std::map<SlaveId, Open> open_;
  std::map<FindingIndex, Reported> reported_;
};

}  // namespace ecaudit
