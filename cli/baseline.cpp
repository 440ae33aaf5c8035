#include "cli/baseline.h"

#include <string_view>

#include "cli/json_file.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"

namespace ecaudit::cli {
namespace {

constexpr std::string_view kBaselineSchema = "ecaudit.baseline/1";

/// One entry of "findings"; nothing when its shape is wrong.
std::optional<Fingerprint> ReadEntry(JsonValue entry) {
  const std::string* rule = entry.member("rule").text();
  const std::string* title = entry.member("title").text();
  const JsonValue slave = entry.member("slave");
  if (entry.size() != 3 || rule == nullptr || title == nullptr || !slave.there()) return std::nullopt;
  if (slave.is_null()) return Fingerprint{*rule, std::nullopt, *title};
  const auto position = slave.natural();
  if (!position || *position > 0xFFFF) return std::nullopt;
  return Fingerprint{*rule, static_cast<SlavePos>(*position), *title};
}

std::string Write(const Baseline& all) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", kBaselineSchema);
    out.List("findings", all, [](report::JsonObject& json, const Fingerprint& f) {
      json.Put("rule", f.rule);
      json.Put("slave", f.slave);
      json.Put("title", f.title);
    });
  });
}

}  // namespace

Fingerprint FingerprintOf(const Finding& finding, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(finding.slave);
  return {std::string(finding.rule), slave == nullptr ? std::nullopt : std::optional(slave->position),
          report::WithoutCounts(report::PrintableLines(finding.title))};
}

Result<Baseline> ReadBaseline(const std::string& path) {
  const Result<JsonDocument> document = ReadJsonFile(path);
  if (!document) return document.error();
  const JsonValue findings = document->root().member("findings");
  if (!document->root().member("schema").is_text(kBaselineSchema) || !findings.is_array()) {
    return Error{path + " is not a baseline (\"schema\": \"" + std::string(kBaselineSchema) + "\")"};
  }
  Baseline baseline;
  for (const JsonValue entry : findings.Elements()) {
    const auto fingerprint = ReadEntry(entry);
    if (!fingerprint) {
      return Error{path + ": each of 'findings' must hold 'rule', 'slave' (position or null) and 'title'"};
    }
    baseline.insert(*fingerprint);
  }
  return baseline;
}

std::string WriteBaseline(const report::Report& report) {
  Baseline all;
  for (const report::CaptureReport& capture : report.captures) {
    for (const Finding& finding : capture.result.findings) all.insert(FingerprintOf(finding, capture.result));
  }
  return Write(all);
}

std::string WriteBaseline(const report::Digest& digest) {
  Baseline all;
  for (const report::CaptureDigest& capture : digest.captures) {
    for (const report::FindingDigest& finding : capture.findings) all.insert(report::FingerprintOf(finding));
  }
  return Write(all);
}

std::optional<Error> CheckBaselinePath(const std::string& path) {
  return CheckReplaced(path, kBaselineSchema, "baseline");
}

void ApplyBaseline(const Baseline& baseline, report::CaptureReport& capture) {
  capture.known.clear();
  for (const Finding& finding : capture.result.findings) {
    capture.known.push_back(baseline.contains(FingerprintOf(finding, capture.result)));
  }
}

void ApplyBaseline(const Baseline& baseline, report::CaptureDigest& capture) {
  for (report::FindingDigest& finding : capture.findings) {
    finding.known = baseline.contains(report::FingerprintOf(finding));
  }
}

}  // namespace ecaudit::cli
