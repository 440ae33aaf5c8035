#include "analyzers/judge/pause_reason.h"

#include "analyzers/sync/sync_model.h"
#include "decoder/track/network.h"

namespace ecaudit {

std::optional<sync::ProcessDataPauses::Pause> PauseReason(const RuleContext& context, SlaveId slave, FrameNo before,
                                                          const FrameRef& now) {
  if (context.network().fmmus(slave).any || !context.sync().Uncertainty(sync::TimeBase::kCapture)) return std::nullopt;
  const auto pause = context.sync().pauses().LongestBetween(before, now);
  if (pause && context.network().MayMissBetween(pause->from.number, pause->to.number)) return std::nullopt;
  return pause;
}

Note NoteOf(const sync::ProcessDataPauses::Pause& pause) {
  return {&kAllPaused,
          {{"paused_from", arg::Frame(pause.from.number)},
           {"paused_to", arg::Frame(pause.to.number)},
           {"pause_ms", arg::Ms(pause.length())}}};
}

}  // namespace ecaudit
