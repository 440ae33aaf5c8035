#include "cli/report/timeline_json.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <vector>

#include "analyzers/result/absence.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"

namespace ecaudit::report {
namespace {

using Bucket = TimeSeries::Bucket;

enum class Shows : std::uint8_t { kValues, kCounts, kBits, kFirst };

/// Whole numbers without ".0", which most process data are.
JsonScalar Number(double value) {
  constexpr double kExact = 9007199254740992.0;  // 2^53
  if (std::abs(value) < kExact && std::nearbyint(value) == value) return static_cast<std::int64_t>(value);
  return value;
}

/// An array of what `value(bucket)` gives for each bucket that holds something.
template <typename Value>
void PutBuckets(JsonObject& out, std::string_view key, const TimeSeries& series, Value value) {
  out.Array(key, [&](JsonArray& array) {
    for (const Bucket& bucket : series.buckets) {
      if (bucket.count != 0) array.Add(value(bucket));
    }
  });
}

void PutSeries(JsonObject& out, std::string_view key, const AnalysisResult& result, const TimeSeries& series,
               Shows shows) {
  std::int64_t start = 0;
  if (series.empty() || !result.capture.origin.has_time ||
      __builtin_sub_overflow(series.start, result.capture.origin.time, &start)) {
    return out.Put(key, nullptr);
  }
  const auto any = [&](auto holds) { return std::ranges::any_of(series.buckets, holds); };
  out.Object(key, [&](JsonObject& json) {
    json.Put("start_s", static_cast<double>(start) / 1e9);
    json.Put("width_s", static_cast<double>(series.width) / 1e9);
    if (any([](const Bucket& bucket) { return bucket.count == 0; })) {
      PutBuckets(json, "at", series, [&](const Bucket& bucket) { return &bucket - series.buckets.data(); });
    }
    if (shows == Shows::kCounts) {
      return PutBuckets(json, "count", series, [](const Bucket& bucket) { return bucket.count; });
    }
    PutBuckets(json, "least", series, [](const Bucket& bucket) { return Number(bucket.least); });
    if (shows == Shows::kFirst) return;
    if (any([](const Bucket& bucket) { return bucket.count != 0 && bucket.most != bucket.least; })) {
      PutBuckets(json, "most", series, [](const Bucket& bucket) { return Number(bucket.most); });
    }
    if (shows != Shows::kBits) return;
    // Between the least and the most value no bit shows what it did.
    if (any([](const Bucket& bucket) { return bucket.count != 0 && bucket.any != bucket.all; })) {
      PutBuckets(json, "any", series, [](const Bucket& bucket) { return bucket.any; });
      PutBuckets(json, "all", series, [](const Bucket& bucket) { return bucket.all; });
    }
  });
}

/// Which frames the values around findings are from. Signals that travel together share them.
class CloseFrames {
 public:
  /// @return its place in lists()
  std::size_t PlaceOf(const std::vector<CloseValue>& values) {
    const auto same = [&values](const std::vector<CloseValue>* other) {
      return std::equal(values.begin(), values.end(), other->begin(), other->end(),
                        [](const CloseValue& a, const CloseValue& b) { return a.frame == b.frame; });
    };
    const auto found = std::ranges::find_if(lists_, same);
    if (found != lists_.end()) return static_cast<std::size_t>(found - lists_.begin());
    lists_.push_back(&values);
    return lists_.size() - 1;
  }
  [[nodiscard]] const std::vector<const std::vector<CloseValue>*>& lists() const { return lists_; }

 private:
  std::vector<const std::vector<CloseValue>*> lists_;
};

void PutCloseFrames(JsonObject& out, const AnalysisResult& result, const std::vector<CloseValue>& values) {
  out.Array("frames", [&](JsonArray& array) {
    for (const CloseValue& value : values) array.Add(value.frame);
  });
  out.Array("time_s", [&](JsonArray& array) {
    for (const CloseValue& value : values) {
      array.Add(SecondsSince(result.capture.origin, FrameRef{value.frame, value.time, true}));
    }
  });
}

/// One number where it never changes, as most process data.
void PutCloseValues(JsonObject& out, const std::vector<CloseValue>& values) {
  const auto differs = [&values](const CloseValue& value) { return value.value != values.front().value; };
  if (std::ranges::none_of(values, differs)) return out.Put("value", Number(values.front().value));
  out.Array("values", [&](JsonArray& array) {
    for (const CloseValue& value : values) array.Add(Number(value.value));
  });
}

void PutSignal(JsonObject& out, const AnalysisResult& result, const SignalSeries& signal, CloseFrames& frames) {
  out.Put("direction", signal.output ? "output" : "input");
  out.Put("index", signal.index);
  out.Put("subindex", signal.subindex);
  out.Put("bits", signal.bits);
  out.TextOrNull("name", signal.name);
  out.Put("name_inferred", signal.name_inferred);
  out.TextOrNull("variable", signal.variable);
  out.TextOrNull("unit", signal.unit);
  out.Put("scaled", signal.scaled);
  out.Put("word", signal.word);
  PutSeries(out, "values", result, signal.values, signal.word ? Shows::kBits : Shows::kValues);
  if (signal.close.empty()) return;
  out.Object("close", [&](JsonObject& close) {
    close.Put("at", frames.PlaceOf(signal.close));
    PutCloseValues(close, signal.close);
  });
}

void PutSdo(JsonObject& out, const AnalysisResult& result, const SdoRow& row) {
  const FrameRef& shown = row.request.seen() ? row.request : row.response;
  out.Put("time_s", SecondsSince(result.capture.origin, shown));
  out.Frame("request_frame", row.request);
  out.Frame("response_frame", row.response);
  out.Put("service", row.download ? "download" : "upload");
  out.Put("complete_access", row.complete_access);
  out.Put("index", row.index);
  out.Put("subindex", row.subindex);
  out.TextOrNull("name", row.name);
  out.TextOrNull("value", row.value);
  out.Put("outcome", row.outcome);
  out.Put("abort_code", row.abort_code);
  out.TextOrNull("abort_text", row.abort_text);
  out.Put("duration_ms", OnlyIf(row.duration.has_value(), static_cast<double>(row.duration.value_or(0)) / 1e6));
}

/// A short working counter does not show whose part is missing; a finding may.
std::string_view KindOf(const ExchangeRun& run, const AnalysisResult& result, const SlaveSummary* slave,
                        const std::vector<Absence>& absences) {
  using Kind = ExchangeRun::Kind;
  if (run.kind == Kind::kTaken) return "taken";
  if (run.kind == Kind::kMissing || slave == nullptr) return run.kind == Kind::kMissing ? "missing" : "unclear";
  for (const Absence& absence : absences) {
    const bool within =
        absence.from.number <= run.first.number && (!absence.to.seen() || absence.to.number >= run.last.number);
    if (within) return "missing";
  }
  return OthersAreMissing(*slave, run.first, run.last, result) ? "taken" : "unclear";
}

void PutExchange(JsonObject& out, std::string_view key, const AnalysisResult& result, const SlaveSummary* slave,
                 const ExchangeLane& lane, const std::vector<Absence>& absences) {
  if (lane.runs.empty()) return out.Put(key, nullptr);
  out.Object(key, [&](JsonObject& json) {
    json.List("runs", lane.runs, [&](JsonObject& run, const ExchangeRun& entry) {
      run.Put("kind", KindOf(entry, result, slave, absences));
      run.Put("from_s", SecondsSince(result.capture.origin, entry.first));
      run.Put("to_s", SecondsSince(result.capture.origin, entry.last));
      run.Frame("frame", entry.first);
      run.Frame("last_frame", entry.last);
      run.Put("count", entry.count);
    });
    json.Put("left_out", lane.left_out);
  });
}

void PutSlaveTimeline(JsonObject& out, const AnalysisResult& result, const SlaveTimeline& slave) {
  const SlaveSummary* summary = result.slave(slave.slave);
  out.Put("slave", summary != nullptr ? JsonScalar(summary->position) : nullptr);
  if (summary == nullptr) {
    out.Object("eni", [&](JsonObject& eni) {
      eni.Put("position", slave.eni_position);
      eni.Put("station_address", slave.eni_address);
      eni.TextOrNull("name", slave.eni_name);
    });
  }
  CloseFrames frames;
  out.List("signals", slave.signals,
           [&](JsonObject& json, const SignalSeries& signal) { PutSignal(json, result, signal, frames); });
  out.List("close", frames.lists(),
           [&](JsonObject& json, const std::vector<CloseValue>* values) { PutCloseFrames(json, result, *values); });
  const std::vector<Absence> absences = summary != nullptr ? AbsencesOf(*summary, result) : std::vector<Absence>();
  PutExchange(out, "outputs", result, summary, slave.outputs, absences);
  PutExchange(out, "inputs", result, summary, slave.inputs, absences);
  out.List("absent", absences, [&](JsonObject& json, const Absence& absence) {
    json.Put("from_s", SecondsSince(result.capture.origin, absence.from));
    json.Put("to_s", SecondsSince(result.capture.origin, absence.to));
  });
  PutSeries(out, "mailbox", result, slave.mailbox, Shows::kCounts);
  out.List("sdos", slave.sdos, [&](JsonObject& json, const SdoRow& row) { PutSdo(json, result, row); });
  out.Put("sdos_left_out", slave.sdos_left_out);
  PutSeries(out, "phase_us", result, slave.phase_us, Shows::kValues);
  PutSeries(out, "difference_ns", result, slave.difference_ns, Shows::kValues);
  const FrameRef settled = summary != nullptr && summary->dc ? summary->dc->settled : FrameRef{};
  out.Put("clock_settled_s", SecondsSince(result.capture.origin, settled));
}

}  // namespace

void PutTimeline(JsonObject& out, const AnalysisResult& result, const Timeline& timeline) {
  PutSeries(out, "frames", result, timeline.frames, Shows::kFirst);
  PutSeries(out, "lost", result, timeline.lost, Shows::kCounts);
  PutSeries(out, "cycle_us", result, timeline.cycle_us, Shows::kValues);
  if (!timeline.cycle_close.empty()) {
    out.Object("cycle_close", [&](JsonObject& close) {
      PutCloseFrames(close, result, timeline.cycle_close);
      PutCloseValues(close, timeline.cycle_close);
    });
  }
  out.Array("slaves", [&](JsonArray& slaves) {
    for (const SlaveTimeline& slave : timeline.slaves) {
      if (result.slave(slave.slave) == nullptr && slave.slave != kNoSlave) continue;  // not one of --slave
      slaves.AddObject([&](JsonObject& json) { PutSlaveTimeline(json, result, slave); });
    }
  });
  out.Put("signals_left_out", timeline.signals_left_out);
}

}  // namespace ecaudit::report
