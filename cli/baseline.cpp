#include "cli/baseline.h"

#include <string_view>

#include <nlohmann/json.hpp>

#include "cli/json_file.h"
#include "cli/report/layout.h"

namespace ecaudit::cli {
namespace {

constexpr std::string_view kSchema = "ecaudit.baseline/1";

/// One entry of "findings"; nothing when its shape is wrong.
std::optional<Fingerprint> ReadEntry(const nlohmann::json& entry) {
  if (!entry.is_object() || entry.size() != 3) return std::nullopt;
  const auto rule = entry.find("rule");
  const auto slave = entry.find("slave");
  const auto title = entry.find("title");
  if (rule == entry.end() || slave == entry.end() || title == entry.end()) return std::nullopt;
  if (!rule->is_string() || !title->is_string()) return std::nullopt;
  Fingerprint fingerprint{rule->get<std::string>(), std::nullopt, title->get<std::string>()};
  if (slave->is_null()) return fingerprint;
  if (!slave->is_number_unsigned() || slave->get<std::uint64_t>() > 0xFFFF) return std::nullopt;
  fingerprint.slave = slave->get<SlavePos>();
  return fingerprint;
}

std::string Write(const Baseline& all) {
  nlohmann::ordered_json json;
  json["schema"] = kSchema;
  json["findings"] = nlohmann::ordered_json::array();
  for (const Fingerprint& f : all) {
    nlohmann::ordered_json entry;
    entry["rule"] = f.rule;
    entry["slave"] = f.slave ? nlohmann::ordered_json(*f.slave) : nlohmann::ordered_json(nullptr);
    entry["title"] = f.title;
    json["findings"].push_back(std::move(entry));
  }
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

Fingerprint FingerprintOf(const Finding& finding, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(finding.slave);
  return {std::string(finding.rule), slave == nullptr ? std::nullopt : std::optional(slave->position),
          report::WithoutCounts(report::PrintableLines(finding.title))};
}

Result<Baseline> ReadBaseline(const std::string& path) {
  const Result<nlohmann::json> document = ReadJsonFile(path);
  if (!document) return document.error();
  if (!document->is_object() || document->value("schema", nlohmann::json()) != kSchema ||
      !document->contains("findings") || !document->at("findings").is_array()) {
    return Error{path + " is not a baseline (\"schema\": \"" + std::string(kSchema) + "\")"};
  }
  Baseline baseline;
  for (const nlohmann::json& entry : document->at("findings")) {
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
  return CheckReplaced(path, kSchema, "baseline");
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
