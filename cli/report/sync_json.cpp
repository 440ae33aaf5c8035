#include <array>
#include <string_view>

#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"
#include "decoder/base/bytes.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::report {
namespace {

void PutClockStep(JsonObject& out, const AnalysisResult& result, const DcStep& step) {
  std::array<std::uint8_t, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(step.value >> (8 * i));
  const ByteSpan written = Slice(bytes, 0, step.length);
  out.Frame("frame", step.frame);
  out.Put("time_s", SecondsSince(result.capture.origin, step.frame));
  out.Put("address", step.address);
  out.TextOrNull("register", Printable(esc::AccessName(step.address, step.length)));
  out.Put("length", step.length);
  out.Put("value", step.value);
  out.Put("text", Printable(esc::DescribeAccess(step.address, written, esc::AccessKind::WRITE)));
  out.Put("broadcast", step.broadcast);
  out.Put("refused", step.refused);
}

void PutSyncPhase(JsonObject& out, const SyncPhase& phase) {
  out.Put("frames", phase.frames);
  out.Put("mean_us", phase.mean_us);
  out.Put("min_us", phase.min_us);
  out.Put("max_us", phase.max_us);
  out.Put("stddev_us", phase.stddev_us);
  out.Put("margin_us", phase.margin_us);
  out.Frame("margin_frame", phase.margin_frame);
  out.Put("empty_intervals", phase.empty_intervals);
  out.Put("double_intervals", phase.double_intervals);
  out.Put("uncertainty_us", phase.uncertainty_us);
  out.Object("histogram", [&](JsonObject& json) {
    json.Put("bin_us", static_cast<double>(phase.cycle_ns) / 1e3 / static_cast<double>(phase.histogram.size()));
    json.Values("counts", phase.histogram);
  });
}

void PutPll(JsonObject& out, const PllSummary& pll) {
  out.Put("distance", pll.distance);
  out.Put("window", pll.window);
  out.Put("threshold", pll.threshold);
  out.Put("reads", pll.reads);
  out.Put("actual_last", OnlyIf(pll.reads > 0, pll.actual_last));
  out.Put("outside", pll.outside);
}

/// From the first read above the limit to the first of the reads that stay within it.
std::optional<double> SettledAfterMs(const DcSummary& dc) {
  if (!dc.settled.has_time || !dc.difference_above.has_time) return std::nullopt;
  return static_cast<double>(Elapsed(dc.difference_above.time, dc.settled.time)) / 1e6;
}

void PutClockDifference(JsonObject& out, const DcSummary& dc) {
  if (dc.difference_reads == 0) return out.Put("difference", nullptr);
  out.Object("difference", [&](JsonObject& json) {
    json.Put("reads", dc.difference_reads);
    json.Put("last_ns", dc.difference_last_ns);
    json.Put("max_ns", dc.difference_max_ns);
    json.Frame("max_frame", dc.difference_max_frame);
    json.Frame("above_frame", dc.difference_above);
    json.Frame("settled_frame", dc.settled);
    json.Put("settled_after_ms", SettledAfterMs(dc));
  });
}

void PutActivated(JsonObject& out, const AnalysisResult& result, const DcSummary& dc) {
  if (!dc.activated.seen()) return out.Put("activated", nullptr);
  out.Object("activated", [&](JsonObject& json) {
    json.Frame("frame", dc.activated);
    json.Put("time_s", SecondsSince(result.capture.origin, dc.activated));
    json.Put("activation", dc.activated_with);
    json.Put("start_time_ns", dc.start_time_ns);
    json.Put("sync0_cycle_ns", dc.sync0_cycle_ns);
    json.Put("sync1_cycle_ns", dc.sync1_cycle_ns);
  });
}

void PutLatches(JsonArray& out, const DcSummary& dc) {
  for (std::size_t i = 0; i < dc.latch_control.size(); ++i) {
    const auto& positive = dc.latch_times_ns[2 * i];
    const auto& negative = dc.latch_times_ns[2 * i + 1];
    if (!dc.latch_control[i] && !dc.latch_status[i] && !positive && !negative) continue;
    out.AddObject([&](JsonObject& json) {
      json.Put("latch", i);
      json.Put("control", dc.latch_control[i]);
      json.Put("status", dc.latch_status[i]);
      json.Put("positive_ns", positive);
      json.Put("negative_ns", negative);
    });
  }
}

void PutBin(JsonObject& out, const CycleBin& bin) {
  out.Put("from_us", bin.from_us);
  out.Put("to_us", bin.to_us);
  out.Put("count", bin.count);
}

void PutOrigins(JsonObject& out, const DelayOrigins& origins) {
  const auto put = [&](std::string_view key, double width) {
    out.Object(key, [&](JsonObject& json) {
      json.Put("width_us", width);
      json.Put("share", origins.ShareOf(width));
    });
  };
  put("master", origins.master_us);
  put("return", origins.return_us);
  if (origins.recorder_us) {
    put("recorder", *origins.recorder_us);
  } else {
    out.Put("recorder", nullptr);
  }
  out.Put("round_trip_us", origins.round_trip_us);
  out.Put("longest_round_trip_us", origins.longest_round_trip_us);
}

}  // namespace

void PutCycle(JsonObject& out, const CycleSummary& c) {
  const bool measured = c.cycles != 0;
  out.Put("cycles", c.cycles);
  out.Put("mean_us", OnlyIf(measured, c.mean_us));
  out.Put("min_us", OnlyIf(measured, c.min_us));
  out.Put("max_us", OnlyIf(measured, c.max_us));
  out.Put("stddev_us", OnlyIf(measured, c.stddev_us));
  out.TextOrNull("time_source", c.time_source);
  out.Put("uncertainty_us", OnlyIf(measured && c.uncertainty_us > 0, c.uncertainty_us));
  out.TextOrNull("command", c.command);
  out.Put("logical_address", OnlyIf(measured, c.logical_address));
  out.Put("median_us", OnlyIf(measured, c.median_us));
  out.Put("p1_us", OnlyIf(measured, c.p1_us));
  out.Put("p99_us", OnlyIf(measured, c.p99_us));
  out.Put("p999_us", OnlyIf(measured, c.p999_us));
  out.Put("missing_cycles", c.missing);
  out.Put("bursts", c.bursts);
  out.Frame("longest_from_frame", c.longest_from);
  out.Frame("longest_to_frame", c.longest_to);
  out.List("histogram", c.histogram, PutBin);
  if (!c.origins) return out.Put("origins", nullptr);
  out.Object("origins", [&](JsonObject& json) { PutOrigins(json, *c.origins); });
}

void PutBusDc(JsonObject& out, std::string_view key, const AnalysisResult& result) {
  const BusDcSummary& dc = result.bus.dc;
  if (dc.samples == 0) return out.Put(key, nullptr);
  const SlaveSummary* reference = result.slave(dc.reference);
  out.Object(key, [&](JsonObject& json) {
    json.Put("reference", reference == nullptr ? JsonScalar(nullptr) : reference->position);
    json.Put("samples", dc.samples);
    json.Put("distributions", dc.distributions);
    json.Frame("first_frame", dc.first);
    json.Frame("last_frame", dc.last);
    json.Put("longest_gap_us", OnlyIf(dc.distributions >= 2, dc.longest_gap_us));
    json.Frame("longest_gap_end_frame", dc.longest_gap_end);
    json.Put("settled_clocks", dc.settled_clocks);
    json.Put("unsettled_clocks", dc.unsettled_clocks);
    const SlaveSummary* last = result.slave(dc.settled_last);
    json.Put("settled_last", last == nullptr ? JsonScalar(nullptr) : last->position);
    json.Frame("settled_frame", dc.settled);
    json.Put("settled_s", SecondsSince(result.capture.origin, dc.settled));
  });
}

void PutDc(JsonObject& out, const AnalysisResult& result, const DcSummary& dc) {
  const esc::SyncActivation activation{dc.activation.value_or(0)};
  out.Put("reference", dc.reference);
  out.Values("receive_times_ns", dc.receive_times_ns);
  out.Put("receive_time_core_ns", dc.receive_time_core_ns);
  out.Put("offset_ns", dc.offset_ns);
  out.Put("delay_ns", dc.delay_ns);
  PutClockDifference(out, dc);
  out.Put("speed_counter_start", dc.speed_counter_start);
  out.Put("speed_counter_difference", dc.speed_counter_difference);
  out.Put("assignment", dc.assignment);
  out.Put("activation", dc.activation);
  out.Put("sync0_active", OnlyIf(dc.activation.has_value(), activation.active() && activation.sync0()));
  PutActivated(out, result, dc);
  out.ObjectOrNull("phase", dc.phase, PutSyncPhase);
  out.ObjectOrNull("pll", dc.pll, PutPll);
  out.Array("latches", [&](JsonArray& latches) { PutLatches(latches, dc); });
  out.List("configuration", dc.configuration,
           [&](JsonObject& json, const DcStep& step) { PutClockStep(json, result, step); });
  out.Put("configuration_left_out", dc.configuration_left_out);
}

}  // namespace ecaudit::report
