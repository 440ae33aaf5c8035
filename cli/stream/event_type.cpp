#include "cli/stream/event_type.h"

#include <algorithm>
#include <array>

#include "cli/suggest.h"

namespace ecaudit::cli {
namespace {

constexpr std::array<std::string_view, kEventTypes> kNames = {
    "register-write", "al-request", "al-state",    "mailbox",    "sdo",     "sdo-info", "pdo-mapping",
    "latch",          "emergency",  "foe",         "eoe",        "soe",     "aoe",      "voe",
    "eeprom",         "dc",         "drive-state", "ecat-event", "left-out"};

}  // namespace

std::string_view Name(EventType type) {
  const auto index = static_cast<std::size_t>(type);
  return index < kNames.size() ? kNames[index] : "?";
}

std::string EventTypeList() {
  std::string list;
  for (const std::string_view name : kNames) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

Result<EventTypes> EventTypes::Parse(const std::vector<std::string>& options) {
  EventTypes types;
  if (options.empty()) {
    types.set_.set();
    // A sync manager may raise its bit in every cycle; the report sums them up.
    types.set_.reset(static_cast<std::size_t>(EventType::kEcatEvent));
  }
  types.chosen_ = !options.empty();
  types.set_.set(static_cast<std::size_t>(EventType::kLeftOut));
  for (const std::string& option : options) {
    std::size_t at = 0;
    while (at <= option.size()) {
      const std::size_t comma = std::min(option.find(',', at), option.size());
      const std::string_view name = std::string_view(option).substr(at, comma - at);
      const auto found = std::ranges::find(kNames, name);
      if (found == kNames.end()) {
        const std::string nearest(Nearest(name, kNames));
        return Error{"unknown event type '" + std::string(name) + "'" +
                     (nearest.empty() ? " (there are " + EventTypeList() + ")" : " (did you mean '" + nearest + "'?)")};
      }
      types.set_.set(static_cast<std::size_t>(found - kNames.begin()));
      at = comma + 1;
    }
  }
  return types;
}

}  // namespace ecaudit::cli
