#include "analyzers/judge/refusal_predictions.h"

#include <algorithm>

#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit {

void RefusalPredictions::Add(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding, Echo echo) {
  Watch(context, slave, request, finding);
  if (finding != kNoFinding) reported_[finding].echo = echo;
  context.ExplainRequest(slave, request, finding);
}

void RefusalPredictions::Watch(RuleContext& context, SlaveId slave, FrameNo request, FindingIndex finding) {
  if (finding == kNoFinding) return;
  Open& open = open_[slave];
  if (open.request != request) open = {request, {}};
  if (std::ranges::find(open.findings, finding) == open.findings.end()) {
    open.findings.push_back(finding);
  }
  reported_.emplace(finding, Reported{context.store[finding].severity});
}

void RefusalPredictions::On(RuleContext& context, const model::AlAnswered& answer) {
  const auto found = open_.find(answer.slave);
  if (found == open_.end()) return;
  const FrameNo request = found->second.request;
  if (request < answer.request.frame.number || request > answer.request.last.number) return;
  const bool refused = answer.outcome == model::AlAnswered::Outcome::kRefused;
  for (const FindingIndex index : found->second.findings) {
    Reported& reported = reported_[index];
    if (refused && !reported.refused) {
      reported.refused = true;
      context.store.Regrade(index, reported.severity);
    } else if (!refused && !reported.refused && !reported.accepted) {
      reported.accepted = true;
      // If the slave refused the write itself, the prediction came true.
      const bool aborted = context.store[index].arguments.Has("abort_code");
      const bool shows_nothing = reported.echo == Echo::kShowsNothing && context.slave(answer.slave).al.echoes();
      if (aborted || shows_nothing) continue;
      context.store.Regrade(index, Severity::kInfo);
      context.store[index].Add(kStateReached, {{"state", arg::State(answer.request.control.state())},
                                               {"reached_frame", arg::Frame(answer.frame.number)}});
    }
  }
  open_.erase(found);
}

}  // namespace ecaudit
