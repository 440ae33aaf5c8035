#include "cli/report/timeline_json.h"

#include <cmath>
#include <cstdint>
#include <string_view>

#include "cli/report/json_parts.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

enum class Shows : std::uint8_t { kValues, kCounts };

/// Whole numbers without ".0", which most process data are.
Json Number(double value) {
  constexpr double kExact = 9007199254740992.0;  // 2^53
  if (std::abs(value) < kExact && std::nearbyint(value) == value) return static_cast<std::int64_t>(value);
  return value;
}

Json Series(const AnalysisResult& result, const TimeSeries& series, Shows shows) {
  if (series.empty() || !result.capture.origin.has_time) return nullptr;
  std::int64_t start = 0;
  if (__builtin_sub_overflow(series.start, result.capture.origin.time, &start)) return nullptr;
  Json json;
  json["start_s"] = static_cast<double>(start) / 1e9;
  json["width_s"] = static_cast<double>(series.width) / 1e9;
  Json at = Json::array();
  Json least = Json::array();
  Json most = Json::array();
  Json count = Json::array();
  bool gaps = false;
  bool ranges = false;
  for (std::size_t i = 0; i < series.buckets.size(); ++i) {
    const TimeSeries::Bucket& bucket = series.buckets[i];
    if (bucket.count == 0) {
      gaps = true;
      continue;
    }
    at.push_back(i);
    if (shows == Shows::kCounts) {
      count.push_back(bucket.count);
      continue;
    }
    least.push_back(Number(bucket.least));
    most.push_back(Number(bucket.most));
    ranges = ranges || bucket.most != bucket.least;
  }
  if (gaps) json["at"] = std::move(at);
  if (shows == Shows::kCounts) {
    json["count"] = std::move(count);
    return json;
  }
  json["least"] = std::move(least);
  if (ranges) json["most"] = std::move(most);
  return json;
}

Json Signal(const AnalysisResult& result, const SignalSeries& signal) {
  return {{"direction", signal.output ? "output" : "input"},
          {"index", signal.index},
          {"subindex", signal.subindex},
          {"bits", signal.bits},
          {"name", TextOrNull(signal.name)},
          {"name_inferred", signal.name_inferred},
          {"variable", TextOrNull(signal.variable)},
          {"unit", TextOrNull(signal.unit)},
          {"scaled", signal.scaled},
          {"values", Series(result, signal.values, Shows::kValues)}};
}

Json Sdo(const AnalysisResult& result, const SdoRow& row) {
  const FrameRef& shown = row.request.seen() ? row.request : row.response;
  return {{"time_s", OrNull(SecondsSince(result.capture.origin, shown))},
          {"request_frame", FrameOrNull(row.request)},
          {"response_frame", FrameOrNull(row.response)},
          {"service", row.download ? "download" : "upload"},
          {"complete_access", row.complete_access},
          {"index", OrNull(row.index)},
          {"subindex", row.subindex},
          {"name", TextOrNull(row.name)},
          {"value", TextOrNull(row.value)},
          {"outcome", row.outcome},
          {"abort_code", OrNull(row.abort_code)},
          {"abort_text", TextOrNull(row.abort_text)},
          {"duration_ms", row.duration ? Json(static_cast<double>(*row.duration) / 1e6) : Json(nullptr)}};
}

}  // namespace

Json TimelineJson(const AnalysisResult& result, const Timeline& timeline) {
  Json json;
  json["lost"] = Series(result, timeline.lost, Shows::kCounts);
  json["cycle_us"] = Series(result, timeline.cycle_us, Shows::kValues);
  json["slaves"] = Json::array();
  for (const SlaveTimeline& slave : timeline.slaves) {
    const SlaveSummary* summary = result.slave(slave.slave);
    if (summary == nullptr && slave.slave != kNoSlave) continue;  // not one of --slave
    Json& entry = json["slaves"].emplace_back();
    entry["slave"] = summary != nullptr ? Json(summary->position) : Json(nullptr);
    if (summary == nullptr) {
      entry["eni"] = {{"position", OrNull(slave.eni_position)},
                      {"station_address", OrNull(slave.eni_address)},
                      {"name", TextOrNull(slave.eni_name)}};
    }
    entry["signals"] = Json::array();
    for (const SignalSeries& signal : slave.signals) entry["signals"].push_back(Signal(result, signal));
    entry["mailbox"] = Series(result, slave.mailbox, Shows::kCounts);
    entry["sdos"] = Json::array();
    for (const SdoRow& row : slave.sdos) entry["sdos"].push_back(Sdo(result, row));
    entry["sdos_left_out"] = slave.sdos_left_out;
    entry["phase_us"] = Series(result, slave.phase_us, Shows::kValues);
    entry["difference_ns"] = Series(result, slave.difference_ns, Shows::kValues);
  }
  json["signals_left_out"] = timeline.signals_left_out;
  return json;
}

}  // namespace ecaudit::report
