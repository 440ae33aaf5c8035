/// The events "drive-state": what a drive is commanded and what it shows, in words.
#include "analyzers/words/drive_text.h"
#include "cli/stream/event_writer.h"
#include "cli/stream/json_line.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using report::Style;

bool IsFault(const std::optional<device::DriveState>& state) {
  return state == device::DriveState::kFault || state == device::DriveState::kFaultReactionActive;
}

}  // namespace

/// One line; what an event does not have stays empty.
struct EventWriter::DriveLine {
  std::string_view kind;
  std::uint8_t axis = 0;
  std::string from, to;
  std::optional<std::uint16_t> word;
  model::DrivePath path;
  FrameRef command;
  std::optional<TimeNs> reaction;
  bool by_sdo = false;
  bool inferred = false;
  std::string text;
  Style style = Style::kPlain;
};

void EventWriter::WriteDrive(SlaveId slave, const FrameRef& frame, const DriveLine& line) {
  EventRow row(*output_, EventType::kDriveState, frame, slave);
  row.fields.Text("kind", line.kind);
  if (line.axis > 0) row.fields.Number("axis", line.axis + 1);
  row.TextOrNull("from", line.from);
  row.TextOrNull("to", line.to);
  row.NumberOrNull("word", line.word);
  std::string& transitions = row.fields.Json("transitions");
  transitions += '[';
  for (std::uint8_t i = 0; i < line.path.count; ++i) {
    if (i > 0) transitions += ',';
    AppendNumber(transitions, line.path.numbers[i]);
  }
  transitions += ']';
  row.Frame("command_frame", line.command);
  row.Milliseconds("reaction_ms", line.reaction);
  row.fields.Text("source", line.by_sdo ? "sdo" : "process data");
  row.fields.Text("certainty", line.inferred ? "inferred" : "observed");
  row.fields.Text("text", line.text);
  if (line.axis > 0) row.text = "axis " + std::to_string(line.axis + 1) + ": ";
  row.text += Printable(line.text);
  row.style = line.style;
  if (line.by_sdo) row.Note("SDO");
}

void EventWriter::On(const model::DriveCommanded& event) {
  if (!output_->Wants(EventType::kDriveState, event.frame, event.slave)) return;
  DriveLine line;
  line.kind = "command";
  line.axis = event.axis;
  if (event.state) line.from = StateText(event.state);
  line.word = event.word;
  line.path = event.path;
  line.by_sdo = event.by_sdo;
  line.inferred = event.inferred;
  line.text = "command: " + CommandText(*ProfileOf(event.slave)->drive, event);
  WriteDrive(event.slave, event.frame, line);
}

void EventWriter::On(const model::DriveBits& event) {
  if (!output_->Wants(EventType::kDriveState, event.frame, event.slave)) return;
  DriveLine line;
  line.kind = "bits";
  line.axis = event.axis;
  line.word = event.word;
  line.by_sdo = event.by_sdo;
  line.inferred = event.inferred;
  line.text = EdgesText(*ProfileOf(event.slave)->drive, event);
  WriteDrive(event.slave, event.frame, line);
}

void EventWriter::On(const model::DriveStateChanged& event) {
  if (!output_->Wants(EventType::kDriveState, event.frame, event.slave)) return;
  DriveLine line;
  line.kind = "state";
  line.axis = event.axis;
  if (event.from) line.from = StateText(event.from);
  line.to = StateText(event.to);
  line.word = event.word;
  line.path = event.path;
  line.command = event.command;
  line.reaction = event.reaction;
  line.by_sdo = event.by_sdo;
  line.inferred = event.inferred;
  line.text = StateChangeText(event);
  if (event.command.seen()) {
    line.text += event.reaction ? ", " + MillisecondsText(event.reaction) + " after" : ", by";
    line.text += " the control word of frame " + std::to_string(event.command.number);
  }
  line.style = IsFault(event.to) ? Style::kError : Style::kPlain;
  WriteDrive(event.slave, event.frame, line);
}

void EventWriter::On(const model::DriveMode& event) {
  if (!output_->Wants(EventType::kDriveState, event.frame, event.slave)) return;
  DriveLine line;
  line.kind = "mode";
  line.axis = event.axis;
  line.by_sdo = event.by_sdo;
  line.inferred = event.inferred;
  line.text = std::string("mode of operation ") + (event.shown ? "shown: " : "requested: ") +
              ModeText(*ProfileOf(event.slave)->drive, event.value);
  WriteDrive(event.slave, event.frame, line);
}

void EventWriter::On(const model::DriveWarning& event) {
  if (!output_->Wants(EventType::kDriveState, event.frame, event.slave)) return;
  DriveLine line;
  line.kind = "warning";
  line.axis = event.axis;
  line.word = event.word;
  line.inferred = event.inferred;
  line.text = event.set ? "warning (status word " + Hex(event.word) + ")" : "no warning any more";
  line.style = event.set ? Style::kWarning : Style::kPlain;
  WriteDrive(event.slave, event.frame, line);
}

void EventWriter::On(const model::DriveFaultExplained& event) {
  if (!output_->Wants(EventType::kDriveState, event.frame, event.slave)) return;
  DriveLine line;
  line.kind = "fault";
  line.axis = event.axis;
  line.text = "reason of the fault in frame " + std::to_string(event.fault.number) + ": " +
              FaultText(*ProfileOf(event.slave), event);
  line.style = Style::kError;
  WriteDrive(event.slave, event.frame, line);
}

}  // namespace ecaudit::cli
