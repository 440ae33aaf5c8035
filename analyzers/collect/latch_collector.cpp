#include "analyzers/collect/latch_collector.h"

namespace ecaudit {

std::optional<LatchSummary> SummariseLatch(const model::LatchUnit& latch) {
  if (latch.description() == nullptr || !latch.seen()) return std::nullopt;
  LatchSummary summary;
  summary.control = latch.control();
  summary.status = latch.status();
  summary.control_by_sdo = latch.control_by_sdo();
  summary.status_by_sdo = latch.status_by_sdo();
  for (std::size_t n = 0; summary.status && n < model::LatchUnit::kMaxInputs; ++n) {
    const std::optional<bool> state = latch.input(n, *summary.status);
    if (!state) continue;
    summary.inputs.push_back({static_cast<std::uint8_t>(n + 1), *state, latch.input_changes(n)});
  }
  for (std::size_t n = 0; n < latch.edges(); ++n) {
    const model::LatchEdgeHistory& history = latch.history(n);
    summary.edges.push_back({latch.edge(n).name, history.armed, history.valid, history.read, history.lost});
  }
  summary.captures.reserve(latch.captures().size());
  for (const model::LatchCapture& capture : latch.captures()) {
    LatchCaptureSummary& out = summary.captures.emplace_back();
    out.edge = latch.edge(capture.edge).name;
    out.armed = capture.armed;
    out.valid = capture.valid;
    out.selected = capture.selected;
    out.acknowledged = capture.acknowledged;
    out.read = capture.read;
    out.disarmed = capture.disarmed;
    out.rearmed = capture.rearmed;
    if (capture.reading != model::LatchReading::kNone) out.read_by = Name(capture.reading);
    out.position = capture.position;
  }
  summary.captures_left_out = latch.captures_left_out();
  summary.misuses = latch.misuses();
  return summary;
}

}  // namespace ecaudit
