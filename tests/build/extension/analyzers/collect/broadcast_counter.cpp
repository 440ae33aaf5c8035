#include "analyzers/collect/broadcast_counter.h"

#include "decoder/wire/command.h"

namespace ecaudit {

BroadcastCounter::BroadcastCounter(EventBus& bus) : bus_(bus) {
  bus.ListenTo<track::Answered>(Stage::kBeforeModel, *this);
}

void BroadcastCounter::On(const track::Answered& answer) {
  if (!wire::IsBroadcast(answer.command) || !answer.returned.seen()) return;
  if (++count_ % 10 == 0) bus_.Publish(TenBroadcasts{answer.returned});
}

void BroadcastCounter::Summarise(AnalysisResult& result) {
  for (SlaveSummary& slave : result.slaves) slave.name += " after " + std::to_string(count_) + " broadcasts";
}

}  // namespace ecaudit
