#include "analyzers/judge/process_data_pauses.h"

#include <algorithm>

#include "analyzers/sync/sync_model.h"
#include "decoder/track/network.h"

namespace ecaudit {

void ProcessDataPauses::On(const track::LogicalAccess& access) {
  const bool outputs = access.command == wire::Command::LRW || access.command == wire::Command::LWR;
  if (!outputs || !access.returned.seen() || access.wkc == 0) return;
  const FrameRef before = last_;
  last_ = access.frame();
  if (!before.has_time || !last_.has_time) return;
  const TimeNs interval = Elapsed(before.time, last_.time);
  if (IsPause(interval)) {
    pauses_[next_++ % pauses_.size()] = {before, last_};
    return;
  }
  usual_ = std::min(interval, interval_ > 0 ? interval_ : interval);
  interval_ = interval;
}

std::optional<ProcessDataPauses::Pause> ProcessDataPauses::LongestBetween(FrameNo before, const FrameRef& now) const {
  if (!now.has_time) return std::nullopt;
  std::optional<Pause> longest;
  const auto consider = [&](const Pause& pause) {
    if (!pause.to.seen() || pause.from.number > now.number) return;
    const bool late = Elapsed(pause.to.time, now.time) > kShows;
    if (pause.to.number < before && late) return;
    if (!longest || pause.length() > longest->length()) longest = pause;
  };
  for (const Pause& pause : pauses_) consider(pause);
  if (last_.has_time && last_.number < now.number && IsPause(Elapsed(last_.time, now.time))) consider({last_, now});
  return longest;
}

std::optional<ProcessDataPauses::Pause> ProcessDataPauses::ReasonOf(const RuleContext& context, SlaveId slave,
                                                                    FrameNo before, const FrameRef& now) const {
  if (context.network().fmmus(slave).any || !context.sync().Uncertainty(sync::TimeBase::kCapture)) return std::nullopt;
  const std::optional<Pause> pause = LongestBetween(before, now);
  if (pause && context.network().MayMissBetween(pause->from.number, pause->to.number)) return std::nullopt;
  return pause;
}

Note NoteOf(const ProcessDataPauses::Pause& pause) {
  return {&kAllPaused,
          {{"paused_from", arg::Frame(pause.from.number)},
           {"paused_to", arg::Frame(pause.to.number)},
           {"pause_ms", arg::Ms(pause.length())}}};
}

}  // namespace ecaudit
