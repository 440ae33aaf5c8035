#include <string_view>

#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

void PutTexts(JsonObject& out, std::string_view key, const std::vector<std::string>& texts) {
  out.Array(key, [&](JsonArray& array) {
    for (const std::string& text : texts) array.Add(Printable(text));
  });
}

std::string_view KindText(DriveStep::Kind kind) {
  static constexpr Named<DriveStep::Kind> kNames[] = {
      {DriveStep::Kind::kCommand, "command"}, {DriveStep::Kind::kState, "state"}, {DriveStep::Kind::kMode, "mode"},
      {DriveStep::Kind::kWarning, "warning"}, {DriveStep::Kind::kFault, "fault"},
  };
  static_assert(NamesAll(kNames, DriveStep::Kind::kFault));
  return NameIn(kNames, kind);
}

void PutDriveStep(JsonObject& out, const AnalysisResult& result, const DriveStep& step) {
  out.Put("kind", KindText(step.kind));
  out.Frame("frame", step.frame);
  out.Put("time_s", SecondsSince(result.capture.origin, step.frame));
  out.Put("text", Printable(step.text));
  out.Put("word", step.word);
  out.Put("source", step.by_sdo ? "sdo" : "process data");
  out.Put("confidence", step.inferred ? "inferred" : "observed");
  if (step.kind == DriveStep::Kind::kState) {
    out.TextOrNull("from", step.from);
    out.TextOrNull("to", step.to);
    out.Frame("command_frame", step.command_frame);
    out.Put("reaction_ms", OnlyIf(step.reaction.has_value(), static_cast<double>(step.reaction.value_or(0)) / 1e6));
  }
  if (step.kind == DriveStep::Kind::kState || step.kind == DriveStep::Kind::kCommand) {
    out.Values("transitions", step.transitions);
  }
}

}  // namespace

void PutDrive(JsonObject& out, const AnalysisResult& result, const DriveSummary& drive) {
  if (drive.axis > 0) out.Put("axis", drive.axis + 1);
  out.TextOrNull("state", drive.state);
  out.Put("status_word", drive.status_word);
  PutTexts(out, "status_bits", drive.status_bits);
  out.Put("control_word", drive.control_word);
  PutTexts(out, "control_bits", drive.control_bits);
  out.Object("mode", [&](JsonObject& mode) {
    mode.Put("requested", drive.mode_requested);
    mode.TextOrNull("requested_name", drive.mode_requested_name);
    mode.Put("shown", drive.mode_shown);
    mode.TextOrNull("shown_name", drive.mode_shown_name);
  });
  out.Put("source", drive.by_sdo ? "sdo" : "process data");
  out.Put("faults", drive.faults);
  PutTexts(out, "enable_sequence", drive.enabled);
  out.List("history", drive.history,
           [&](JsonObject& json, const DriveStep& step) { PutDriveStep(json, result, step); });
  out.Put("history_left_out", drive.history_left_out);
}

}  // namespace ecaudit::report
