#include "cli/baseline.h"

#include <chrono>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include "cli/json_file.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "cli/report/sentences.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::string_view kBaselineSchema = "ecaudit.baseline/1";

std::string Today() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return report::DateText(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count(), false);
}

/// One entry of "findings"; nothing when its shape is wrong.
std::optional<Baseline::value_type> ReadEntry(JsonValue entry) {
  const std::string_view* rule = entry.member("rule").text();
  const std::string_view* identity = entry.member("identity").text();
  const std::string_view* title = entry.member("title").text();
  const JsonValue slave = entry.member("slave");
  std::size_t members = 2 + (identity == nullptr ? 0U : 1U) + (title == nullptr ? 0U : 1U);
  Acceptance accepted;
  if (title != nullptr) accepted.title = *title;
  accepted.by_title = identity == nullptr;
  if (const JsonValue reason = entry.member("reason"); reason.there()) {
    if (!reason.is_text()) return std::nullopt;
    accepted.reason = *reason.text();
    ++members;
  }
  if (const JsonValue expires = entry.member("expires"); expires.there()) {
    if (!expires.is_text() || !report::IsDate(*expires.text())) return std::nullopt;
    accepted.expires = *expires.text();
    accepted.expired = accepted.expires < Today();  // ISO dates sort as text
    ++members;
  }
  if (entry.size() != members || rule == nullptr || (identity == nullptr && title == nullptr) || !slave.there()) {
    return std::nullopt;
  }
  // Identities have no colon.
  Fingerprint fingerprint{std::string(*rule), std::nullopt,
                          identity != nullptr ? std::string(*identity) : "title: " + accepted.title};
  if (!slave.is_null()) {
    const auto position = slave.natural();
    if (!position || *position > 0xFFFF) return std::nullopt;
    fingerprint.slave = static_cast<SlavePos>(*position);
  }
  return Baseline::value_type{std::move(fingerprint), std::move(accepted)};
}

/// Whether a finding is known, and its reason.
std::pair<bool, std::string> Lookup(const Baseline& baseline, const Fingerprint& fingerprint) {
  const auto found = baseline.find(fingerprint);
  if (found == baseline.end() || found->second.expired) return {false, {}};
  const Acceptance& accepted = found->second;
  std::string because = accepted.reason;
  if (!accepted.expires.empty()) because += (because.empty() ? "until " : "; until ") + accepted.expires;
  return {true, because};
}

/// Adds a finding with its reason from the file before.
void Add(const Fingerprint& fingerprint, const std::string& title, const Baseline& before, Baseline& all) {
  Acceptance accepted;
  accepted.title = title;
  if (const auto found = before.find(fingerprint); found != before.end()) {
    accepted.reason = found->second.reason;
    // Who lists it again accepts it again.
    if (!found->second.expired) accepted.expires = found->second.expires;
  }
  all.emplace(fingerprint, std::move(accepted));
}

std::string Write(const Baseline& all) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", kBaselineSchema);
    out.List("findings", all, [](report::JsonObject& json, const Baseline::value_type& entry) {
      json.Put("rule", entry.first.rule);
      json.Put("slave", entry.first.slave);
      json.Text("identity", entry.first.identity);
      json.Text("title", entry.second.title);
      if (!entry.second.reason.empty()) json.Text("reason", entry.second.reason);
      if (!entry.second.expires.empty()) json.Text("expires", entry.second.expires);
    });
  });
}

}  // namespace

Fingerprint FingerprintOf(const Finding& finding, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(finding.slave);
  return {std::string(finding.rule), slave == nullptr ? std::nullopt : std::optional(slave->position),
          report::IdentityText(finding)};
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
    auto read = ReadEntry(entry);
    if (!read) {
      return Error{
          path +
          ": each of 'findings' must hold 'rule', 'slave' (position or null) and 'identity'; it may hold 'title', "
          "'reason' and 'expires' (\"2026-12-31\")"};
    }
    baseline.insert(std::move(*read));
  }
  return baseline;
}

std::string WriteBaseline(const report::Report& report, const Baseline& before) {
  Baseline all;
  for (const report::CaptureReport& capture : report.captures) {
    for (const Finding& finding : capture.result.findings) {
      Add(FingerprintOf(finding, capture.result), report::TitleOf(finding), before, all);
    }
  }
  return Write(all);
}

std::string WriteBaseline(const report::Digest& digest, const Baseline& before) {
  Baseline all;
  for (const report::CaptureDigest& capture : digest.captures) {
    for (const report::FindingDigest& finding : capture.findings) {
      Add(report::FingerprintOf(finding), finding.title, before, all);
    }
  }
  return Write(all);
}

Baseline BaselineBefore(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  Result<Baseline> before = ReadBaseline(path);
  return before ? std::move(*before) : Baseline{};
}

std::vector<std::string> ExpiredEntries(const Baseline& baseline) {
  std::vector<std::string> texts;
  std::size_t by_title = 0;
  for (const auto& [fingerprint, accepted] : baseline) {
    if (accepted.by_title) ++by_title;
    if (!accepted.expired || accepted.by_title) continue;
    texts.push_back(fingerprint.rule + " of " +
                    (fingerprint.slave ? "slave " + std::to_string(*fingerprint.slave) : std::string("the bus")) +
                    " was accepted until " + accepted.expires + " only, and counts again" +
                    (accepted.reason.empty() ? "" : " (" + accepted.reason + ")"));
  }
  if (by_title > 0) {
    texts.push_back(Count(by_title, "entry", "entries") +
                    " without an identity match no finding: write the baseline again with --write-baseline");
  }
  return texts;
}

std::optional<Error> CheckBaselinePath(const std::string& path) {
  return CheckReplaced(path, kBaselineSchema, "a baseline");
}

void ApplyBaseline(const Baseline& baseline, report::CaptureReport& capture) {
  capture.known.clear();
  capture.known_because.clear();
  for (const Finding& finding : capture.result.findings) {
    auto [known, because] = Lookup(baseline, FingerprintOf(finding, capture.result));
    capture.known.push_back(known);
    capture.known_because.push_back(std::move(because));
  }
}

void ApplyBaseline(const Baseline& baseline, report::CaptureDigest& capture) {
  for (report::FindingDigest& finding : capture.findings) {
    std::tie(finding.known, finding.known_because) = Lookup(baseline, report::FingerprintOf(finding));
    finding.known_because = report::PrintableLines(finding.known_because);
  }
}

}  // namespace ecaudit::cli
