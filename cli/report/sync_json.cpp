#include "cli/report/sync_json.h"

#include <string_view>

#include "cli/report/json_parts.h"
#include "cli/report/times.h"
#include "decoder/base/bytes.h"
#include "decoder/base/text.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::report {
namespace {

Json Step(const AnalysisResult& result, const DcStep& step) {
  std::array<std::uint8_t, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(step.value >> (8 * i));
  const ByteSpan written = Slice(bytes, 0, step.length);
  const std::string name = Printable(esc::AccessName(step.address, step.length));
  return {{"frame", FrameOrNull(step.frame.number)},
          {"time_s", OrNull(SecondsSince(result.capture.origin, step.frame))},
          {"address", step.address},
          {"register", TextOrNull(name)},
          {"length", step.length},
          {"value", step.value},
          {"text", Printable(esc::DescribeAccess(step.address, written, esc::AccessKind::WRITE))},
          {"broadcast", step.broadcast},
          {"refused", step.refused}};
}

Json Phase(const SyncPhase& phase) {
  return {{"frames", phase.frames},
          {"mean_us", phase.mean_us},
          {"min_us", phase.min_us},
          {"max_us", phase.max_us},
          {"stddev_us", phase.stddev_us},
          {"margin_us", phase.margin_us},
          {"margin_frame", FrameOrNull(phase.margin_frame.number)},
          {"empty_intervals", phase.empty_intervals},
          {"double_intervals", phase.double_intervals},
          {"uncertainty_us", phase.uncertainty_us},
          {"histogram",
           {{"bin_us", static_cast<double>(phase.cycle_ns) / 1e3 / static_cast<double>(phase.histogram.size())},
            {"counts", phase.histogram}}}};
}

}  // namespace

Json CycleJson(const CycleSummary& c) {
  const auto measured = [&c](auto value) { return c.cycles == 0 ? Json(nullptr) : Json(value); };
  Json json;
  json["cycles"] = c.cycles;
  json["mean_us"] = measured(c.mean_us);
  json["min_us"] = measured(c.min_us);
  json["max_us"] = measured(c.max_us);
  json["stddev_us"] = measured(c.stddev_us);
  json["time_source"] = TextOrNull(c.time_source);
  json["uncertainty_us"] = c.cycles == 0 || c.uncertainty_us <= 0 ? Json(nullptr) : Json(c.uncertainty_us);
  json["command"] = TextOrNull(c.command);
  json["logical_address"] = measured(c.logical_address);
  json["median_us"] = measured(c.median_us);
  json["p1_us"] = measured(c.p1_us);
  json["p99_us"] = measured(c.p99_us);
  json["p999_us"] = measured(c.p999_us);
  json["missing_cycles"] = c.missing;
  json["bursts"] = c.bursts;
  json["longest_from_frame"] = FrameOrNull(c.longest_from.number);
  json["longest_to_frame"] = FrameOrNull(c.longest_to.number);
  json["histogram"] = Json::array();
  for (const CycleBin& bin : c.histogram) {
    json["histogram"].push_back({{"from_us", bin.from_us}, {"to_us", bin.to_us}, {"count", bin.count}});
  }
  return json;
}

Json BusDcJson(const AnalysisResult& result) {
  const BusDcSummary& dc = result.bus.dc;
  if (dc.samples == 0) return nullptr;
  const SlaveSummary* reference = result.slave(dc.reference);
  return {{"reference", reference == nullptr ? Json(nullptr) : Json(reference->position)},
          {"samples", dc.samples},
          {"distributions", dc.distributions},
          {"first_frame", FrameOrNull(dc.first.number)},
          {"last_frame", FrameOrNull(dc.last.number)},
          {"longest_gap_us", dc.distributions < 2 ? Json(nullptr) : Json(dc.longest_gap_us)},
          {"longest_gap_end_frame", FrameOrNull(dc.longest_gap_end.number)}};
}

Json DcJson(const AnalysisResult& result, const SlaveSummary& slave) {
  const DcSummary& dc = *slave.dc;
  Json json;
  json["reference"] = dc.reference;
  json["receive_times_ns"] = Json::array();
  for (const auto& time : dc.receive_times_ns) json["receive_times_ns"].push_back(OrNull(time));
  json["receive_time_core_ns"] = OrNull(dc.receive_time_core_ns);
  json["offset_ns"] = OrNull(dc.offset_ns);
  json["delay_ns"] = OrNull(dc.delay_ns);
  json["difference"] = nullptr;
  if (dc.difference_reads > 0) {
    json["difference"] = {{"reads", dc.difference_reads},
                          {"last_ns", dc.difference_last_ns},
                          {"max_ns", dc.difference_max_ns},
                          {"max_frame", FrameOrNull(dc.difference_max_frame)}};
  }
  json["speed_counter_start"] = OrNull(dc.speed_counter_start);
  json["speed_counter_difference"] = OrNull(dc.speed_counter_difference);
  json["assignment"] = OrNull(dc.assignment);
  json["activation"] = OrNull(dc.activation);
  json["sync0_active"] =
      dc.activation ? Json(esc::SyncActivation{*dc.activation}.active() && esc::SyncActivation{*dc.activation}.sync0())
                    : Json(nullptr);
  json["activated"] = nullptr;
  if (dc.activated.seen()) {
    json["activated"] = {{"frame", FrameOrNull(dc.activated.number)},
                         {"time_s", OrNull(SecondsSince(result.capture.origin, dc.activated))},
                         {"activation", OrNull(dc.activated_with)},
                         {"start_time_ns", OrNull(dc.start_time_ns)},
                         {"sync0_cycle_ns", OrNull(dc.sync0_cycle_ns)},
                         {"sync1_cycle_ns", OrNull(dc.sync1_cycle_ns)}};
  }
  json["phase"] = dc.phase ? Phase(*dc.phase) : Json(nullptr);
  json["pll"] = nullptr;
  if (dc.pll) {
    const PllSummary& pll = *dc.pll;
    json["pll"] = {{"distance", OrNull(pll.distance)},
                   {"window", OrNull(pll.window)},
                   {"threshold", OrNull(pll.threshold)},
                   {"reads", pll.reads},
                   {"actual_last", pll.reads > 0 ? Json(pll.actual_last) : Json(nullptr)},
                   {"outside", pll.outside}};
  }
  json["latches"] = Json::array();
  for (std::size_t i = 0; i < dc.latch_control.size(); ++i) {
    if (!dc.latch_control[i] && !dc.latch_status[i] && !dc.latch_times_ns[2 * i] && !dc.latch_times_ns[2 * i + 1])
      continue;
    json["latches"].push_back({{"latch", i},
                               {"control", OrNull(dc.latch_control[i])},
                               {"status", OrNull(dc.latch_status[i])},
                               {"positive_ns", OrNull(dc.latch_times_ns[2 * i])},
                               {"negative_ns", OrNull(dc.latch_times_ns[2 * i + 1])}});
  }
  json["configuration"] = Json::array();
  for (const DcStep& step : dc.configuration) json["configuration"].push_back(Step(result, step));
  json["configuration_left_out"] = dc.configuration_left_out;
  return json;
}

}  // namespace ecaudit::report
