#include "analyzers/collect/prediction_statistics.h"

namespace ecaudit {

PredictionStatistics::PredictionStatistics(const model::BusModel& model, const Explanations& explanations,
                                           EventBus& bus)
    : model_(model), explanations_(explanations) {
  bus.ListenTo<model::AlAnswered, model::AlChangedByItself, model::AlOverdue, model::Predicted, track::LogicalAccess>(
      Stage::kBeforeModel, *this);
}

void PredictionStatistics::Count(PredictionCount& count, bool held, const FrameRef& frame) {
  ++count.made;
  if (held) {
    ++count.held;
  } else if (count.deviations.size() < PredictionCount::kMaxDeviations) {
    count.deviations.push_back(frame.number);
  }
}

void PredictionStatistics::On(const model::AlAnswered& event) {
  using Outcome = model::AlAnswered::Outcome;
  bool refuse = explanations_.Of(event.slave, event.request.frame.number) != kNoFinding;
  switch (event.request.verdict) {
    case model::AlVerdict::kLegal:
      // What the manual lists without an effect may be followed or refused.
      if (event.request.transition != nullptr && !event.request.transition->performed) return;
      break;
    case model::AlVerdict::kIllegal:
    case model::AlVerdict::kInvalid:
      refuse = true;
      break;
    case model::AlVerdict::kNeedsAcknowledge:
    case model::AlVerdict::kUnknown:
      return;
  }
  Count(summary_.al_answers, refuse ? event.outcome == Outcome::kRefused : event.outcome == Outcome::kReached,
        event.frame);
}

void PredictionStatistics::On(const model::AlChangedByItself& event) {
  Count(summary_.al_answers, false, event.frame);
}

void PredictionStatistics::On(const model::AlOverdue& event) {
  Count(summary_.al_answers, false, event.frame);
}

void PredictionStatistics::On(const model::Predicted& event) {
  Count(summary_.mailbox_accesses, event.held, event.frame);
}

void PredictionStatistics::On(const track::LogicalAccess& access) {
  if (access.assumed || access.circulating || !access.returned.seen()) return;
  const model::LogicalExpectation& expected = model_.Expect(access);
  if (!expected.complete) return;
  const model::CounterRange range = model_.RangeFor(expected, access.command);
  if (range.least != range.most) return;
  Count(summary_.working_counters, access.wkc == range.most, access.frame());
}

}  // namespace ecaudit
