#include "analyzers/judge/refusal_predictions.h"

#include <algorithm>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "decoder/esc/al.h"

namespace ecaudit {

void RefusalPredictions::Add(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding) {
  Watch(context, slave, request, finding);
  context.ExplainRequest(slave, request, finding);
}

void RefusalPredictions::Watch(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding) {
  if (finding == kNoFinding) return;
  Open& open = open_[slave];
  if (open.request != request) open = {request, {}};
  if (std::find(open.findings.begin(), open.findings.end(), finding) == open.findings.end()) {
    open.findings.push_back(finding);
  }
  told_.emplace(finding, Told{context.store[finding].severity});
}

void RefusalPredictions::On(RuleContext& context, const model::AlAnswered& answer) {
  const auto found = open_.find(answer.slave);
  if (found == open_.end()) return;
  const FrameNo request = found->second.request;
  if (request < answer.request.frame.number || request > answer.request.last.number) return;
  const bool refused = answer.outcome == model::AlAnswered::Outcome::kRefused;
  for (const FindingIndex index : found->second.findings) {
    Told& told = told_[index];
    if (refused && !told.refused) {
      told.refused = true;
      context.store.Regrade(index, told.severity);
    } else if (!refused && !told.refused && !told.accepted) {
      told.accepted = true;
      // Where the slave refused the write itself, what was foretold did happen.
      const std::vector<Evidence>& evidence = context.store[index].evidence;
      const bool aborted =
          std::any_of(evidence.begin(), evidence.end(), [](const Evidence& e) { return e.name == "abort_code"; });
      // A slave without a processor takes every state, and says nothing by it.
      if (aborted || context.slave(answer.slave).al.echoes()) continue;
      context.store.Regrade(index, Severity::kInfo);
      context.store[index].message += " The slave reached " + esc::StateName(answer.request.control.state()) +
                                      " all the same (frame " + std::to_string(answer.frame.number) + ").";
    }
  }
  open_.erase(found);
}

}  // namespace ecaudit
