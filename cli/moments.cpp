#include "cli/moments.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "cli/interrupt.h"
#include "cli/report/times.h"
#include "cli/stream/spool.h"

namespace ecaudit::cli {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kNsPerDay = 86'400 * kNsPerSecond;

bool NeedsCapture(const std::optional<Moment>& moment) {
  return moment && (moment->kind == Moment::Kind::kClock || moment->kind == Moment::Kind::kTime);
}

/// What of a capture its moments are placed by.
struct Anchor {
  std::optional<TimeNs> origin;  ///< first time stamp
  std::optional<TimeNs> around;  ///< stamp of the frame that was asked for
  bool reached = false;          ///< that frame is there
};

Result<Anchor> ReadAnchor(std::span<const std::string> paths, const std::vector<std::uint16_t>& interfaces,
                          std::optional<FrameNo> around) {
  for (const std::string& path : paths) {
    if (Spool::CanBeReadTwice(path)) continue;
    return Error{path + " can be read only once: give seconds or a frame number for --from and --to"};
  }
  auto source = CapturePaths({paths.begin(), paths.end()}, interfaces).Open();
  if (!source) return source.error();
  Anchor anchor;
  capture::CapturedFrame frame;
  while (!InterruptFlag() && (*source)->Next(frame) == capture::ReadStatus::kFrame) {
    if (!anchor.origin && frame.has_time) anchor.origin = frame.time;
    if (around && frame.number == *around) {
      anchor.reached = true;
      if (frame.has_time) anchor.around = frame.time;
    }
    if (anchor.origin && (!around || frame.number >= *around)) break;
  }
  return anchor;
}

/// A time of the day means the one nearest to the beginning of the capture, which may run over midnight.
TimeNs NearestTo(TimeNs origin, const Moment& moment) {
  const std::string day = report::DateText(origin, moment.local);
  const TimeNs midnight = report::ParseIsoTime(day, moment.local).value_or(0);
  const TimeNs same_day = midnight + moment.ns;
  if (origin - same_day > kNsPerDay / 2) return same_day + kNsPerDay;
  return same_day - origin > kNsPerDay / 2 ? same_day - kNsPerDay : same_day;
}

/// Seconds from the first packet.
double SecondsOf(const Moment& moment, TimeNs origin) {
  if (moment.kind == Moment::Kind::kSeconds) return moment.seconds;
  const TimeNs time = moment.kind == Moment::Kind::kTime ? moment.ns : NearestTo(origin, moment);
  std::int64_t ns = 0;
  if (__builtin_sub_overflow(time, origin, &ns)) return time < origin ? -1e12 : 1e12;
  return static_cast<double>(ns) / 1e9;
}

/// Without what no time stamp holds: the sum of two doubles has digits of its own.
double WholeNanoseconds(double seconds) {
  constexpr double kLargest = 9e15;  // ns that a double holds one by one
  const double ns = seconds * 1e9;
  return std::abs(ns) < kLargest ? std::round(ns) / 1e9 : seconds;
}

/// "58 s before the first packet, which is of 2019-05-01T12:00:00Z"
std::string BeforeText(double seconds, TimeNs origin) {
  return Fixed(-seconds, 3) + " s before the first packet, which is of " + report::IsoTime(origin);
}

void SetLimit(const Moment& moment, TimeNs origin, std::optional<double>& seconds, std::optional<FrameNo>& frame) {
  if (moment.kind == Moment::Kind::kFrame) {
    frame = moment.frame;
  } else {
    seconds = SecondsOf(moment, origin);
  }
}

}  // namespace

Result<Moment> ParseMoment(std::string_view option, std::string_view text, bool local) {
  Moment moment;
  moment.local = local;
  const char* const end = text.data() + text.size();
  if (text.starts_with('#')) {
    const auto [rest, code] = std::from_chars(text.data() + 1, end, moment.frame);
    moment.kind = Moment::Kind::kFrame;
    if (code == std::errc() && rest == end && moment.frame > 0) return moment;
  } else if (const auto time = report::ParseIsoTime(text, local)) {
    moment.kind = Moment::Kind::kTime;
    moment.ns = *time;
    return moment;
  } else if (text.find(':') != std::string_view::npos) {
    std::string_view rest = text;
    moment.kind = Moment::Kind::kClock;
    const auto clock = report::ParseClock(rest);
    if (clock && rest.empty()) {
      moment.ns = *clock;
      return moment;
    }
  } else if (!text.empty()) {
    const auto [rest, code] = std::from_chars(text.data(), end, moment.seconds);
    if (code == std::errc() && rest == end && std::isfinite(moment.seconds) && moment.seconds >= 0) return moment;
  }
  return Error{std::string(option) + " is '" + std::string(text) +
               "' but must be seconds such as 1.5, a frame number such as #760, or a clock time such as 02:13:07.250"};
}

bool MomentRange::needs_capture() const {
  return NeedsCapture(from) || NeedsCapture(to) ||
         (around && (NeedsCapture(around) || around->kind == Moment::Kind::kFrame));
}

std::optional<Error> PlaceMoments(const MomentRange& range, std::span<const std::string> paths,
                                  AnalysisOptions& analysis, std::vector<std::string>* notices) {
  Anchor anchor;
  if (range.needs_capture()) {
    const bool by_frame = range.around && range.around->kind == Moment::Kind::kFrame;
    Result<Anchor> read =
        ReadAnchor(paths, analysis.interfaces, by_frame ? std::optional(range.around->frame) : std::nullopt);
    if (!read) return read.error();
    anchor = *read;
    // If the user stopped reading, the next reader of the capture reports it.
    if (InterruptFlag()) return std::nullopt;
    const std::string& name = paths.front();
    if (!anchor.origin) return Error{name + " has no time stamps: give frame numbers"};
    if (by_frame && !anchor.reached) {
      return Error{name + " has no frame " + std::to_string(range.around->frame)};
    }
    if (by_frame && !anchor.around) {
      return Error{name + ": frame " + std::to_string(range.around->frame) + " has no time stamp"};
    }
  }
  const TimeNs origin = anchor.origin.value_or(0);
  if (range.from) SetLimit(*range.from, origin, analysis.from_s, analysis.from_frame);
  if (range.to) SetLimit(*range.to, origin, analysis.to_s, analysis.to_frame);
  if (range.around) {
    Moment middle = *range.around;
    if (middle.kind == Moment::Kind::kFrame) middle = {Moment::Kind::kTime, 0, 0, *anchor.around, false};
    const double seconds = SecondsOf(middle, origin);
    analysis.from_s = seconds - range.window_s;
    analysis.to_s = seconds + range.window_s;
  }
  if (analysis.from_s) analysis.from_s = WholeNanoseconds(*analysis.from_s);
  if (analysis.to_s) analysis.to_s = WholeNanoseconds(*analysis.to_s);
  if (analysis.to_s && *analysis.to_s < 0) {
    return Error{paths.front() + ": no packet of the capture lies in the range: " +
                 (range.around ? "--around and --window end " : "--to is ") + BeforeText(*analysis.to_s, origin)};
  }
  if (range.from && analysis.from_s && *analysis.from_s < 0 && notices != nullptr) {
    notices->push_back(paths.front() + ": --from is " + BeforeText(*analysis.from_s, origin) +
                       ": the range begins with the capture");
  }
  // There is nothing before the first packet, so no user means that time.
  if (analysis.from_s) analysis.from_s = std::max(0.0, *analysis.from_s);
  if ((range.from && range.to) &&
      ((analysis.from_s && analysis.to_s && *analysis.from_s > *analysis.to_s) ||
       (analysis.from_frame && analysis.to_frame && *analysis.from_frame > *analysis.to_frame))) {
    return Error{"--from is later than --to"};
  }
  return std::nullopt;
}

}  // namespace ecaudit::cli
