#include <optional>
#include <string_view>

#include "cli/report/alike_steps.h"
#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

std::string_view OutcomeText(StartupOutcome outcome) {
  static constexpr Named<StartupOutcome> kNames[] = {
      {StartupOutcome::kDone, "done"},
      {StartupOutcome::kRefused, "refused"},
      {StartupOutcome::kUnanswered, "unanswered"},
      {StartupOutcome::kUnknown, "unknown"},
  };
  static_assert(NamesAll(kNames, StartupOutcome::kUnknown));
  return NameIn(kNames, outcome);
}

std::string_view StepKindText(StartupKey::Kind kind) {
  static constexpr Named<StartupKey::Kind> kNames[] = {
      {StartupKey::Kind::kWrite, "write"},     {StartupKey::Kind::kEeprom, "eeprom"},
      {StartupKey::Kind::kRequest, "request"}, {StartupKey::Kind::kDownload, "download"},
      {StartupKey::Kind::kUpload, "upload"},   {StartupKey::Kind::kDrive, "drive"},
  };
  static_assert(NamesAll(kNames, StartupKey::Kind::kDrive));
  return NameIn(kNames, kind);
}

/// What the step is about, in the words of its kind.
void PutKey(JsonObject& out, const StartupKey& key) {
  switch (key.kind) {
    case StartupKey::Kind::kDownload:
    case StartupKey::Kind::kUpload:
      out.Put("index", key.address);
      out.Put("subindex", key.subindex);
      out.Put("complete_access", key.complete_access);
      break;
    case StartupKey::Kind::kRequest:
      out.Put("state", esc::StateName(static_cast<std::uint8_t>(key.address)));
      break;
    case StartupKey::Kind::kDrive:
      out.Put("control_word", key.address);
      break;
    case StartupKey::Kind::kWrite:
    case StartupKey::Kind::kEeprom:
      out.Put("address", key.address);
      break;
  }
}

void PutReadBack(JsonObject& out, const StartupStep& step) {
  if (!step.read_back_frame.seen()) return out.Put("read_back", nullptr);
  out.Object("read_back", [&](JsonObject& json) {
    json.Put("frame", step.read_back_frame.number);
    json.Put("data", HexBytes(step.read_back));
    json.Put("differs", !step.read_text.empty());
    json.TextOrNull("text", step.read_text);
  });
}

/// When the slave had it; what it was, unless a row of steps that are alike shows it.
void PutStep(JsonObject& out, const AnalysisResult& result, const StartupStep& step, std::optional<std::size_t> alike) {
  if (alike) out.Put("alike", *alike);
  out.Frame("frame", step.frame);
  out.Frame("last_frame", step.last);
  out.Put("time_s", SecondsSince(result.capture.origin, step.frame));
  if (!alike) PutStepWhat(out, step);
  PutReadBack(out, step);
}

void PutPhase(JsonObject& out, const AnalysisResult& result, const StartupPhaseSummary& phase) {
  out.Put("phase", Name(phase.phase));
  out.Frame("frame", phase.first);
  out.Frame("last_frame", phase.last);
  out.Put("time_s", SecondsSince(result.capture.origin, phase.first));
  out.Put("duration_ms", OnlyIf(phase.duration.has_value(), static_cast<double>(phase.duration.value_or(0)) / 1e6));
  out.Put("accesses", phase.accesses);
  out.TextOrNull("result", phase.result);
  out.Put("failed", phase.failed);
}

}  // namespace

void PutStepWhat(JsonObject& out, const StartupStep& step) {
  out.Put("phase", Name(step.phase));
  out.Put("kind", StepKindText(step.key.kind));
  out.Put("count", step.count);
  PutKey(out, step.key);
  out.Put("name", Printable(step.name));
  out.TextOrNull("data", HexBytes(step.data));
  out.Put("length", step.size);
  out.TextOrNull("text", step.text);
  out.Put("volatile", step.volatile_value);
  out.Put("broadcast", step.broadcast);
  out.Put("outcome", OutcomeText(step.outcome));
  out.Put("code", OnlyIf(step.outcome == StartupOutcome::kRefused && step.code != 0, step.code));
  out.TextOrNull("note", step.note);
}

void PutAlikeSteps(JsonObject& out, std::string_view key, const AlikeSteps& alike) {
  out.List(key, alike.rows(), [](JsonObject& json, const AlikeSteps::Row& row) {
    json.Values("slaves", row.slaves);
    PutStepWhat(json, *row.step);
  });
}

void PutStartup(JsonObject& out, std::string_view key, const AnalysisResult& result, const StartupSummary& startup,
                const AlikeSteps* alike) {
  if (!startup.seen) return out.Put(key, nullptr);
  out.Object(key, [&](JsonObject& json) {
    json.TextOrNull("reached", startup.reached == 0 ? "" : esc::StateName(startup.reached));
    json.Put("attempts", startup.again + 1);
    json.Frame("again_frame", startup.again_frame);
    json.List("phases", startup.phases,
              [&](JsonObject& out_phase, const StartupPhaseSummary& phase) { PutPhase(out_phase, result, phase); });
    json.List("steps", startup.steps, [&](JsonObject& out_step, const StartupStep& step) {
      PutStep(out_step, result, step, alike == nullptr ? std::nullopt : alike->RowOf(step));
    });
    json.Put("steps_left_out", startup.steps_left_out);
  });
}

}  // namespace ecaudit::report
