#include "cli/report/times.h"

#include <array>
#include <charconv>
#include <chrono>

#include "decoder/base/system/program.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

void AppendPadded(std::string& out, std::int64_t value, std::size_t digits) {
  const std::string text = std::to_string(value);
  if (text.size() < digits) out.append(digits - text.size(), '0');
  out += text;
}

/// A point in time as calendars and clocks have it.
struct Moment {
  std::chrono::year_month_day date;
  std::int64_t second_of_day = 0;
  std::int64_t ns = 0;
};

/// Whole seconds since 1970, towards minus infinity: stamps before that are possible in a damaged file.
std::int64_t SecondsOf(TimeNs time) {
  return time / kNsPerSecond - (time % kNsPerSecond < 0 ? 1 : 0);
}

/// What local time is ahead of UTC by.
std::int64_t ZoneSeconds(TimeNs time) {
  return system::ZoneSeconds(SecondsOf(time));
}

Moment MomentOf(TimeNs time, bool local) {
  const std::int64_t seconds = SecondsOf(time) + (local ? ZoneSeconds(time) : 0);
  const std::chrono::sys_seconds point{std::chrono::seconds(seconds)};
  const auto day = std::chrono::floor<std::chrono::days>(point);
  const std::int64_t ns = time % kNsPerSecond;
  return {std::chrono::year_month_day{day}, (point - day).count(), ns < 0 ? ns + kNsPerSecond : ns};
}

void AppendDate(std::string& out, const Moment& moment) {
  AppendPadded(out, static_cast<int>(moment.date.year()), 4);
  out += '-';
  AppendPadded(out, static_cast<unsigned>(moment.date.month()), 2);
  out += '-';
  AppendPadded(out, static_cast<unsigned>(moment.date.day()), 2);
}

void AppendClock(std::string& out, const Moment& moment, std::size_t digits) {
  AppendPadded(out, moment.second_of_day / 3600, 2);
  out += ':';
  AppendPadded(out, moment.second_of_day / 60 % 60, 2);
  out += ':';
  AppendPadded(out, moment.second_of_day % 60, 2);
  if (digits == 0) return;
  out += '.';
  AppendPadded(out, moment.ns, 9);
  out.resize(out.size() - (9 - digits));
}

/// Takes a number of `digits` digits from the front of `text`.
std::optional<std::int64_t> TakeNumber(std::string_view& text, std::size_t digits) {
  std::int64_t value = 0;
  if (text.size() < digits) return std::nullopt;
  const auto [end, code] = std::from_chars(text.data(), text.data() + digits, value);
  if (code != std::errc() || end != text.data() + digits || text.front() == '-') return std::nullopt;
  text.remove_prefix(digits);
  return value;
}

bool TakeSign(std::string_view& text, std::string_view any_of) {
  if (text.empty() || any_of.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

/// Takes "2026-12-31" from the front of `text`.
std::optional<std::chrono::year_month_day> TakeDate(std::string_view& text) {
  const auto year = TakeNumber(text, 4);
  if (!year || !TakeSign(text, "-")) return std::nullopt;
  const auto month = TakeNumber(text, 2);
  if (!month || !TakeSign(text, "-")) return std::nullopt;
  const auto day = TakeNumber(text, 2);
  if (!day) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(*year)),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  return date.ok() ? std::optional(date) : std::nullopt;
}

}  // namespace

std::string IsoTime(TimeNs time) {
  const Moment moment = MomentOf(time, false);
  std::string out;
  AppendDate(out, moment);
  out += 'T';
  AppendClock(out, moment, 9);
  out += 'Z';
  return out;
}

std::string IsoLocalTime(TimeNs time) {
  return DateText(time, true) + "T" + ClockText(time, true, 9) + ZoneText(time, true);
}

std::optional<std::int64_t> ParseClock(std::string_view& text) {
  const auto hour = TakeNumber(text, 2);
  if (!hour || *hour > 23 || !TakeSign(text, ":")) return std::nullopt;
  const auto minute = TakeNumber(text, 2);
  if (!minute || *minute > 59) return std::nullopt;
  std::int64_t ns = (*hour * 3600 + *minute * 60) * kNsPerSecond;
  if (!TakeSign(text, ":")) return ns;
  const auto second = TakeNumber(text, 2);
  if (!second || *second > 59) return std::nullopt;
  ns += *second * kNsPerSecond;
  if (!TakeSign(text, ".,")) return ns;
  std::int64_t unit = kNsPerSecond;
  std::size_t digits = 0;
  for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1), ++digits) {
    unit /= 10;
    ns += (text.front() - '0') * unit;  // digits after the ninth count nothing
  }
  return digits > 0 ? std::optional(ns) : std::nullopt;
}

bool IsDate(std::string_view text) {
  return TakeDate(text).has_value() && text.empty();
}

std::optional<TimeNs> ParseIsoTime(std::string_view text, bool local) {
  const auto taken = TakeDate(text);
  if (!taken) return std::nullopt;
  const std::chrono::year_month_day date = *taken;
  // What 64 bits of nanoseconds reach.
  if (date.year() < std::chrono::year(1678) || date.year() > std::chrono::year(2261)) return std::nullopt;
  std::int64_t clock = 0;
  if (!text.empty()) {
    if (!TakeSign(text, "Tt ")) return std::nullopt;
    const auto parsed = ParseClock(text);
    if (!parsed) return std::nullopt;
    clock = *parsed;
  }
  const TimeNs time = std::chrono::sys_days(date).time_since_epoch().count() * 86'400 * kNsPerSecond + clock;
  if (text.empty()) return local ? time - ZoneSeconds(time - ZoneSeconds(time) * kNsPerSecond) * kNsPerSecond : time;
  if (TakeSign(text, "Zz")) return text.empty() ? std::optional(time) : std::nullopt;
  const bool west = text.front() == '-';
  if (!TakeSign(text, "+-")) return std::nullopt;
  const auto hours = TakeNumber(text, 2);
  TakeSign(text, ":");
  const auto minutes = TakeNumber(text, 2);
  if (!hours || !minutes || !text.empty()) return std::nullopt;
  const std::int64_t ahead = (*hours * 60 + *minutes) * 60 * kNsPerSecond;
  return west ? time + ahead : time - ahead;
}

std::string_view Name(TimeMode mode) {
  constexpr std::array<std::string_view, 3> kNames{"relative", "utc", "local"};
  return kNames[static_cast<std::size_t>(mode)];
}

std::optional<TimeMode> ParseTimeMode(std::string_view text) {
  for (const TimeMode mode : {TimeMode::kRelative, TimeMode::kUtc, TimeMode::kLocal}) {
    if (Name(mode) == text) return mode;
  }
  return std::nullopt;
}

std::string ClockText(TimeNs time, bool local, std::size_t digits) {
  std::string out;
  AppendClock(out, MomentOf(time, local), digits);
  return out;
}

std::string DateText(TimeNs time, bool local) {
  std::string out;
  AppendDate(out, MomentOf(time, local));
  return out;
}

std::string ZoneText(TimeNs time, bool local) {
  if (!local) return "UTC";
  const std::int64_t minutes = ZoneSeconds(time) / 60;
  std::string out(1, minutes < 0 ? '-' : '+');
  AppendPadded(out, (minutes < 0 ? -minutes : minutes) / 60, 2);
  out += ':';
  AppendPadded(out, (minutes < 0 ? -minutes : minutes) % 60, 2);
  return out;
}

std::string MomentText(TimeMode mode, const FrameRef& first, const FrameRef& frame, std::size_t digits) {
  if (mode == TimeMode::kRelative) {
    const auto seconds = SecondsSince(first, frame);
    return seconds ? Fixed(*seconds, static_cast<int>(digits)) + " s" : std::string();
  }
  if (!frame.has_time) return {};
  const bool local = mode == TimeMode::kLocal;
  const std::string date = DateText(frame.time, local);
  const std::string clock = ClockText(frame.time, local, digits);
  return first.has_time && DateText(first.time, local) == date ? clock : date + " " + clock;
}

std::optional<double> SecondsSince(const FrameRef& first, const FrameRef& frame) {
  if (!first.has_time || !frame.has_time) return std::nullopt;
  // Both are below 2^63; the difference of a damaged file may not be.
  std::int64_t difference = 0;
  if (__builtin_sub_overflow(frame.time, first.time, &difference)) return std::nullopt;
  return static_cast<double>(difference) / 1e9;
}

}  // namespace ecaudit::report
