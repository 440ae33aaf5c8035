#include "decoder/device/sync_description.h"

#include <algorithm>

namespace ecaudit::device {

std::vector<const DriveParameter*> SyncDescription::DriveParameters() const {
  std::vector<const DriveParameter*> known;
  for (const std::optional<DriveParameter>* parameter :
       {&cycle_count, &sync_distance, &sync_actual, &sync_window, &pll_threshold, &supervision, &pll_switch}) {
    if (*parameter) known.push_back(&**parameter);
  }
  return known;
}

const JitterLimit* SyncDescription::FindJitter(TimeNs cycle) const {
  const auto it = std::ranges::find_if(jitter, [&](const JitterLimit& limit) {
    return (!limit.cycle_min || cycle >= *limit.cycle_min) && (!limit.cycle_max || cycle <= *limit.cycle_max);
  });
  return it == jitter.end() ? nullptr : &*it;
}

}  // namespace ecaudit::device
