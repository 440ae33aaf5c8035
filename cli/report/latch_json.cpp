#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"

namespace ecaudit::report {
namespace {

JsonScalar Millis(const FrameRef& from, const FrameRef& to) {
  if (!from.seen() || !to.seen() || !from.has_time || !to.has_time) return nullptr;
  return static_cast<double>(to.time - from.time) / 1e6;
}

JsonScalar Source(const std::optional<std::uint16_t>& word, bool by_sdo) {
  return OnlyIf(word.has_value(), by_sdo ? "sdo" : "process data");
}

void PutInput(JsonObject& out, const LatchInputSummary& input) {
  out.Put("input", input.number);
  out.Put("state", input.state);
  out.Put("changes", input.changes);
}

void PutEdge(JsonObject& out, const LatchEdgeSummary& edge) {
  out.Text("edge", edge.name);
  out.Put("armed", edge.armed);
  out.Put("valid", edge.valid);
  out.Put("read", edge.read);
  out.Put("lost", edge.lost);
}

void PutLatchCapture(JsonObject& out, const LatchCaptureSummary& c) {
  out.Text("edge", c.edge);
  out.Frame("armed_frame", c.armed);
  out.Frame("valid_frame", c.valid);
  out.Frame("selected_frame", c.selected);
  out.Frame("acknowledged_frame", c.acknowledged);
  out.Frame("read_frame", c.read);
  out.Frame("disarmed_frame", c.disarmed);
  out.Frame("rearmed_frame", c.rearmed);
  out.TextOrNull("read_by", c.read_by);
  out.Put("position", c.position);
  out.Put("arm_to_valid_ms", Millis(c.armed, c.valid));
  out.Put("valid_to_read_ms", Millis(c.valid, c.read));
  out.Put("read_to_rearm_ms", Millis(c.read, c.rearmed));
}

}  // namespace

void PutLatch(JsonObject& out, const LatchSummary& latch) {
  out.Put("control", latch.control);
  out.Put("control_source", Source(latch.control, latch.control_by_sdo));
  out.Put("status", latch.status);
  out.Put("status_source", Source(latch.status, latch.status_by_sdo));
  out.List("digital_inputs", latch.inputs, PutInput);
  out.List("edges", latch.edges, PutEdge);
  out.List("captures", latch.captures, PutLatchCapture);
  out.Put("captures_left_out", latch.captures_left_out);
  out.Put("misuses", latch.misuses);
}

}  // namespace ecaudit::report
