/// Points in time as reports write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "decoder/base/ids.h"

namespace ecaudit::report {

/// ISO 8601 in UTC with nanoseconds: "2019-05-01T12:00:00.123456789Z".
[[nodiscard]] std::string IsoTime(TimeNs time);
/// The same with the local time of this machine: "2019-05-01T14:00:00.123456789+02:00".
[[nodiscard]] std::string IsoLocalTime(TimeNs time);

/// Reads what IsoTime() writes, also with fewer digits, without seconds, with a space for the T, and with "+01:00" for
/// the Z. Without a zone it is `local` time of this machine or UTC.
[[nodiscard]] std::optional<TimeNs> ParseIsoTime(std::string_view text, bool local);

/// "2026-12-31", a day that calendars have.
[[nodiscard]] bool IsDate(std::string_view text);

/// Takes "02:13", "02:13:07" or "02:13:07.250" from the front of `text`: nanoseconds of the day.
[[nodiscard]] std::optional<std::int64_t> ParseClock(std::string_view& text);

/// How points in time are written for people.
enum class TimeMode : std::uint8_t {
  kRelative,  ///< seconds from the first packet
  kUtc,
  kLocal,  ///< of this machine
};
[[nodiscard]] std::string_view Name(TimeMode mode);
/// Reads what Name() writes; nothing for any other text.
[[nodiscard]] std::optional<TimeMode> ParseTimeMode(std::string_view text);

/// "02:13:07.250" with a number of digits after the second (at most 9), cut, not rounded.
[[nodiscard]] std::string ClockText(TimeNs time, bool local, std::size_t digits);
/// "2026-03-02"
[[nodiscard]] std::string DateText(TimeNs time, bool local);
/// "UTC", or the difference of local time at that moment: "+01:00".
[[nodiscard]] std::string ZoneText(TimeNs time, bool local);

/// A point in time within a capture: "0.759000 s", "02:13:07.250123"; with its date where that is not the one on which
/// the capture begins. Empty where one of the two is not known.
/// @param digits  after the second
[[nodiscard]] std::string MomentText(TimeMode mode, const FrameRef& first, const FrameRef& frame, std::size_t digits);

/// Seconds from the first packet of the capture; nothing when one of the two has no time stamp.
/// Negative when the stamps go backwards.
[[nodiscard]] std::optional<double> SecondsSince(const FrameRef& first, const FrameRef& frame);

}  // namespace ecaudit::report
