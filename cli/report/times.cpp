#include "cli/report/times.h"

#include <chrono>

namespace ecaudit::report {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

void AppendPadded(std::string& out, std::int64_t value, std::size_t digits) {
  const std::string text = std::to_string(value);
  if (text.size() < digits) out.append(digits - text.size(), '0');
  out += text;
}

}  // namespace

std::string IsoTime(TimeNs time) {
  // Integer division towards minus infinity: stamps before 1970 are possible in a damaged file.
  std::int64_t seconds = time / kNsPerSecond;
  std::int64_t ns = time % kNsPerSecond;
  if (ns < 0) {
    ns += kNsPerSecond;
    --seconds;
  }
  const std::chrono::sys_seconds point{std::chrono::seconds(seconds)};
  const auto day = std::chrono::floor<std::chrono::days>(point);
  const std::chrono::year_month_day date{day};
  const std::int64_t second_of_day = (point - day).count();

  std::string out;
  AppendPadded(out, static_cast<int>(date.year()), 4);
  out += '-';
  AppendPadded(out, static_cast<unsigned>(date.month()), 2);
  out += '-';
  AppendPadded(out, static_cast<unsigned>(date.day()), 2);
  out += 'T';
  AppendPadded(out, second_of_day / 3600, 2);
  out += ':';
  AppendPadded(out, second_of_day / 60 % 60, 2);
  out += ':';
  AppendPadded(out, second_of_day % 60, 2);
  out += '.';
  AppendPadded(out, ns, 9);
  out += 'Z';
  return out;
}

std::optional<double> SecondsSince(const FrameRef& first, const FrameRef& frame) {
  if (!first.has_time || !frame.has_time) return std::nullopt;
  // Both are below 2^63; the difference of a damaged file may not be.
  std::int64_t difference = 0;
  if (__builtin_sub_overflow(frame.time, first.time, &difference)) return std::nullopt;
  return static_cast<double>(difference) / 1e9;
}

}  // namespace ecaudit::report
