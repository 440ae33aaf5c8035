/// Points in time as reports write them.
#pragma once

#include <optional>
#include <string>

#include "decoder/base/ids.h"

namespace ecaudit::report {

/// ISO 8601 in UTC with nanoseconds: "2019-05-01T12:00:00.123456789Z".
[[nodiscard]] std::string IsoTime(TimeNs time);

/// Seconds from the first packet of the capture; nothing when one of the two has no time stamp.
/// Negative when the stamps go backwards.
[[nodiscard]] std::optional<double> SecondsSince(const FrameRef& first, const FrameRef& frame);

}  // namespace ecaudit::report
