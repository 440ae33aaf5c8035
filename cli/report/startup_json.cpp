#include "cli/report/startup_json.h"

#include <optional>
#include <string_view>

#include "cli/report/json_parts.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

Json StateOrNull(std::uint8_t state) {
  return state == 0 ? Json(nullptr) : Json(esc::StateName(state));
}

std::string_view OutcomeText(StartupOutcome outcome) {
  switch (outcome) {
    case StartupOutcome::kDone:
      return "done";
    case StartupOutcome::kRefused:
      return "refused";
    case StartupOutcome::kUnknown:
      break;
  }
  return "unknown";
}

std::string_view KindText(StartupKey::Kind kind) {
  switch (kind) {
    case StartupKey::Kind::kWrite:
      return "write";
    case StartupKey::Kind::kEeprom:
      return "eeprom";
    case StartupKey::Kind::kRequest:
      return "request";
    case StartupKey::Kind::kDownload:
      return "download";
    case StartupKey::Kind::kUpload:
      return "upload";
    case StartupKey::Kind::kDrive:
      break;
  }
  return "drive";
}

Json Step(const AnalysisResult& result, const StartupStep& step) {
  Json json;
  json["phase"] = Name(step.phase);
  json["kind"] = KindText(step.key.kind);
  json["frame"] = FrameOrNull(step.frame);
  json["last_frame"] = FrameOrNull(step.last);
  json["time_s"] = OrNull(SecondsSince(result.capture.origin, step.frame));
  json["count"] = step.count;
  const bool sdo = step.key.kind == StartupKey::Kind::kDownload || step.key.kind == StartupKey::Kind::kUpload;
  if (sdo) {
    json["index"] = step.key.address;
    json["subindex"] = step.key.subindex;
    json["complete_access"] = step.key.complete_access;
  } else if (step.key.kind == StartupKey::Kind::kRequest) {
    json["state"] = esc::StateName(static_cast<std::uint8_t>(step.key.address));
  } else if (step.key.kind == StartupKey::Kind::kDrive) {
    json["control_word"] = step.key.address;
  } else {
    json["address"] = step.key.address;
  }
  json["name"] = Printable(step.name);
  json["data"] = step.data.empty() ? Json(nullptr) : Json(HexBytes(step.data));
  json["length"] = step.size;
  json["text"] = TextOrNull(step.text);
  json["volatile"] = step.volatile_value;
  json["broadcast"] = step.broadcast;
  json["outcome"] = OutcomeText(step.outcome);
  json["code"] = step.outcome == StartupOutcome::kRefused && step.code != 0 ? Json(step.code) : Json(nullptr);
  json["note"] = TextOrNull(step.note);
  json["read_back"] = nullptr;
  if (step.read_back_frame.seen()) {
    json["read_back"] = {{"frame", step.read_back_frame.number},
                         {"data", HexBytes(step.read_back)},
                         {"differs", !step.read_text.empty()},
                         {"text", TextOrNull(step.read_text)}};
  }
  return json;
}

Json Phase(const AnalysisResult& result, const StartupPhaseSummary& phase) {
  Json json;
  json["phase"] = Name(phase.phase);
  json["frame"] = FrameOrNull(phase.first);
  json["last_frame"] = FrameOrNull(phase.last);
  json["time_s"] = OrNull(SecondsSince(result.capture.origin, phase.first));
  json["duration_ms"] = phase.duration ? Json(static_cast<double>(*phase.duration) / 1e6) : Json(nullptr);
  json["accesses"] = phase.accesses;
  json["result"] = TextOrNull(phase.result);
  json["failed"] = phase.failed;
  return json;
}

}  // namespace

Json StartupJson(const AnalysisResult& result, const StartupSummary& startup) {
  if (!startup.seen) return nullptr;
  Json json;
  json["reached"] = StateOrNull(startup.reached);
  json["attempts"] = startup.again + 1;
  json["again_frame"] = FrameOrNull(startup.again_frame);
  json["phases"] = Json::array();
  for (const StartupPhaseSummary& phase : startup.phases) json["phases"].push_back(Phase(result, phase));
  json["steps"] = Json::array();
  for (const StartupStep& step : startup.steps) json["steps"].push_back(Step(result, step));
  json["steps_left_out"] = startup.steps_left_out;
  return json;
}

}  // namespace ecaudit::report
