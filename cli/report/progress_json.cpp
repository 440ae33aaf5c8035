#include "analyzers/result/progress.h"
#include "cli/report/finding_id.h"
#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"

namespace ecaudit::report {
namespace {

void PutRung(JsonObject& out, const AnalysisResult& result, const Rung& rung) {
  out.Put("rung", rung.rung->code);
  out.Put("status", Name(rung.status));
  out.Frame("frame", rung.since);
  out.Put("time_s", SecondsSince(result.capture.origin, rung.since));
  out.Frame("until_frame", rung.until);
  out.Put("until_s", SecondsSince(result.capture.origin, rung.until));
  out.TextOrNull("why", rung.why != nullptr ? rung.why->code : std::string_view());
  out.TextOrNull("text", rung.why != nullptr ? rung.why->text : std::string_view());
  const std::string finding = rung.held_by == kNoFinding ? std::string() : FindingId(result, rung.held_by);
  out.TextOrNull("finding", finding);
}

}  // namespace

void PutLadder(JsonObject& out, std::string_view key, const AnalysisResult& result, const Ladder& ladder) {
  out.List(key, ladder.rungs, [&](JsonObject& json, const Rung& rung) { PutRung(json, result, rung); });
}

}  // namespace ecaudit::report
