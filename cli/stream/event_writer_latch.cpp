/// The events "latch": what happened to the latches of a drive, and what was done wrong with them.
#include "cli/stream/event_writer.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using StepKind = model::LatchStep::Kind;

std::string_view Name(StepKind kind) {
  static constexpr Named<StepKind> kNames[] = {
      {StepKind::kArmed, "arm"}, {StepKind::kRearmed, "rearm"},   {StepKind::kValid, "valid"},
      {StepKind::kRead, "read"}, {StepKind::kDisarmed, "disarm"},
  };
  return NameIn(kNames, kind);
}

std::optional<TimeNs> Between(const FrameRef& from, const FrameRef& to) {
  if (!from.seen() || !to.seen() || !from.has_time || !to.has_time) return std::nullopt;
  return to.time - from.time;
}

void AddCapture(EventRow& row, const model::LatchCapture& capture) {
  row.Frame("armed_frame", capture.armed);
  row.Frame("valid_frame", capture.valid);
  row.Frame("read_frame", capture.read);
  row.TextOrNull("read_by", capture.reading == model::LatchReading::kNone ? "" : model::Name(capture.reading));
  row.NumberOrNull("position", capture.position);
}

}  // namespace

void EventWriter::On(const model::LatchStep& event) {
  if (!output_->Wants(EventType::kLatch, event.frame, event.slave)) return;
  EventRow row(*output_, EventType::kLatch, event.frame, event.slave);
  const model::LatchCapture& capture = event.capture;
  std::optional<TimeNs> latency;
  row.text = Printable(event.edge->name);
  switch (event.kind) {
    case StepKind::kArmed:
      row.text += " armed";
      break;
    case StepKind::kRearmed:
      row.text += " armed again";
      break;
    case StepKind::kValid:
      latency = Between(capture.armed, capture.valid);
      row.text += " valid";
      if (latency) row.text += " " + Duration(*latency) + " after it was armed";
      break;
    case StepKind::kRead:
      latency = Between(capture.valid, capture.read);
      row.text += " read by " + std::string(model::Name(capture.reading));
      if (capture.position) row.text += ", position " + std::to_string(*capture.position);
      if (latency) row.text += ", " + Duration(*latency) + " after it was valid";
      break;
    case StepKind::kDisarmed:
      row.text += " disarmed";
      if (capture.valid.seen() && !capture.read.seen()) row.text += " unread";
      break;
  }
  row.fields.Text("step", Name(event.kind));
  row.fields.Text("edge", event.edge->name);
  row.fields.Number("control", event.control);
  row.NumberOrNull("status", event.status);
  AddCapture(row, capture);
  row.Milliseconds("latency_ms", latency);
  row.fields.Null("rule");
  if (capture.assumed) row.Note("not known whether the drive accepted it");
}

void EventWriter::On(const model::LatchMisuse& event) {
  if (!output_->Wants(EventType::kLatch, event.frame, event.slave)) return;
  EventRow row(*output_, EventType::kLatch, event.frame, event.slave);
  const std::string edge = event.edge == nullptr ? "" : event.edge->name;
  const std::string_view rule = model::RuleOf(event.kind);
  row.fields.Text("step", "misuse");
  row.TextOrNull("edge", edge);
  row.fields.Number("control", event.control);
  row.NumberOrNull("status", event.status);
  AddCapture(row, event.capture);
  row.fields.Null("latency_ms");
  row.fields.Text("rule", rule);
  row.text = std::string(rule) + (edge.empty() ? "" : ": " + Printable(edge)) + ", control word " + Hex(event.control);
  if (event.status) row.text += ", status word " + Hex(*event.status);
  row.style = report::Style::kError;
}

}  // namespace ecaudit::cli
