#include "analyzers/sync/process_data_pauses.h"

#include <algorithm>

namespace ecaudit::sync {

void ProcessDataPauses::On(const track::LogicalAccess& access) {
  const bool outputs = access.command == wire::Command::LRW || access.command == wire::Command::LWR;
  if (!outputs || !access.returned.seen() || access.wkc == 0 || access.returned.number == last_.number) return;
  const FrameRef before = last_;
  last_ = access.returned;
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

}  // namespace ecaudit::sync
