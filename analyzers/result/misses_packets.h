/// How reasons begin that say a rule could not be judged, or not everywhere, for the capture misses packets.
#pragma once

#include <string_view>

namespace ecaudit {

inline constexpr std::string_view kSaysItMissesPackets = "the capture misses packets";

}  // namespace ecaudit
