#include "cli/report/drive_json.h"

#include <string_view>

#include "cli/report/json_parts.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

Json Texts(const std::vector<std::string>& texts) {
  Json json = Json::array();
  for (const std::string& text : texts) json.push_back(Printable(text));
  return json;
}

std::string_view KindText(DriveStep::Kind kind) {
  switch (kind) {
    case DriveStep::Kind::kCommand:
      return "command";
    case DriveStep::Kind::kState:
      return "state";
    case DriveStep::Kind::kMode:
      return "mode";
    case DriveStep::Kind::kWarning:
      return "warning";
    case DriveStep::Kind::kFault:
      break;
  }
  return "fault";
}

Json Step(const AnalysisResult& result, const DriveStep& step) {
  Json json;
  json["kind"] = KindText(step.kind);
  json["frame"] = FrameOrNull(step.frame.number);
  json["time_s"] = OrNull(SecondsSince(result.capture.origin, step.frame));
  json["text"] = Printable(step.text);
  json["word"] = OrNull(step.word);
  json["source"] = step.by_sdo ? "sdo" : "process data";
  json["confidence"] = step.inferred ? "inferred" : "observed";
  if (step.kind == DriveStep::Kind::kState) {
    json["from"] = TextOrNull(step.from);
    json["to"] = TextOrNull(step.to);
    json["command_frame"] = FrameOrNull(step.command_frame);
    json["reaction_ms"] = step.reaction ? Json(static_cast<double>(*step.reaction) / 1e6) : Json(nullptr);
  }
  if (step.kind == DriveStep::Kind::kState || step.kind == DriveStep::Kind::kCommand) {
    json["transitions"] = step.transitions;
  }
  return json;
}

}  // namespace

Json DriveJson(const AnalysisResult& result, const SlaveSummary& slave) {
  const DriveSummary& drive = *slave.drive;
  Json json;
  json["state"] = TextOrNull(drive.state);
  json["status_word"] = OrNull(drive.status_word);
  json["status_bits"] = Texts(drive.status_bits);
  json["control_word"] = OrNull(drive.control_word);
  json["control_bits"] = Texts(drive.control_bits);
  json["mode"] = {{"requested", OrNull(drive.mode_requested)},
                  {"requested_name", TextOrNull(drive.mode_requested_name)},
                  {"shown", OrNull(drive.mode_shown)},
                  {"shown_name", TextOrNull(drive.mode_shown_name)}};
  json["source"] = drive.by_sdo ? "sdo" : "process data";
  json["faults"] = drive.faults;
  json["enable_sequence"] = Texts(drive.enabled);
  json["history"] = Json::array();
  for (const DriveStep& step : drive.history) json["history"].push_back(Step(result, step));
  json["history_left_out"] = drive.history_left_out;
  return json;
}

}  // namespace ecaudit::report
