#include "cli/baseline.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "analyzers/judge/catalogue.h"
#include "analyzers/judge/coverage.h"
#include "cli/json_file.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "cli/report/sentences.h"
#include "cli/report/times.h"
#include "cli/suggest.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/names.h"
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
  const auto texts = [&entry](std::string_view key, std::vector<std::string>& out) {
    const JsonValue list = entry.member(key);
    if (!list.is_array()) return false;
    for (const JsonValue text : list.Elements()) {
      if (!text.is_text()) return false;
      out.emplace_back(*text.text());
    }
    return true;
  };
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
  for (const auto& [key, list] : {std::pair("devices", &accepted.devices), std::pair("captures", &accepted.captures)}) {
    if (!entry.member(key).there()) continue;
    if (!texts(key, *list)) return std::nullopt;
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

/// Where a finding occurs.
struct Place {
  std::string_view capture;          ///< path
  std::vector<std::string> devices;  ///< the slave's, or those of the bus; empty: the capture does not show them
};

std::string_view NameIn(std::string_view path) {
  // Of the files of a ring buffer the first one.
  path = path.substr(0, path.find(", "));
  return system::NameOf(path);
}

/// Whether the entry is about this machine.
bool IsFor(const Acceptance& accepted, const Place& place) {
  const std::vector<std::string>& devices = accepted.devices;
  if (devices.empty() && accepted.captures.empty()) return true;
  if (std::ranges::find(devices, "*") != devices.end()) return true;
  if (!devices.empty() && !place.devices.empty()) {
    // The rest of a bus may be out of sight; what is in sight is not another device.
    return std::ranges::all_of(
        place.devices, [&](const std::string& device) { return std::ranges::find(devices, device) != devices.end(); });
  }
  const std::string name(NameIn(place.capture));
  return std::ranges::any_of(accepted.captures,
                             [&](const std::string& pattern) { return system::MatchesPattern(name, pattern); });
}

/// Whether a finding is known, and its reason.
std::pair<bool, std::string> Lookup(const Baseline& baseline, const Fingerprint& fingerprint, const Place& place) {
  const auto [begin, end] = baseline.equal_range(fingerprint);
  for (auto entry = begin; entry != end; ++entry) {
    const Acceptance& accepted = entry->second;
    if (accepted.expired || !IsFor(accepted, place)) continue;
    std::string because = accepted.reason;
    if (!accepted.expires.empty()) because += (because.empty() ? "until " : "; until ") + accepted.expires;
    return {true, because};
  }
  return {false, {}};
}

/// Adds a finding with its reason from the file before.
void Add(const Fingerprint& fingerprint, const std::string& title, const Place& place, const Baseline& before,
         Baseline& all) {
  const std::string pattern = PatternOf(place.capture);
  const auto add_pattern = [&pattern](std::vector<std::string>& patterns) {
    const auto at = std::ranges::lower_bound(patterns, pattern);
    if (at == patterns.end() || *at != pattern) patterns.insert(at, pattern);
  };
  const auto [begin, end] = all.equal_range(fingerprint);
  for (auto entry = begin; entry != end; ++entry) {
    if (entry->second.devices != place.devices && !IsFor(entry->second, place)) continue;
    if (!entry->second.captures.empty()) add_pattern(entry->second.captures);
    return;
  }
  Acceptance accepted;
  accepted.title = title;
  accepted.devices = place.devices;
  accepted.captures = {pattern};
  const auto [first, last] = before.equal_range(fingerprint);
  for (auto entry = first; entry != last; ++entry) {
    if (!IsFor(entry->second, place)) continue;
    // What a user wrote stays: the reason, and where the entry holds.
    const Acceptance& old = entry->second;
    accepted.reason = old.reason;
    accepted.devices = old.devices;
    accepted.captures = old.captures;
    // A finding that is listed again is accepted again.
    if (!old.expired) accepted.expires = old.expires;
    break;
  }
  all.emplace(fingerprint, std::move(accepted));
}

std::vector<std::string> DevicesOf(const AnalysisResult& result) {
  std::vector<std::string> devices;
  for (const SlaveSummary& slave : result.slaves) {
    std::string device = report::ProductText(slave.identity.vendor_id, slave.identity.product_code);
    const auto at = std::ranges::lower_bound(devices, device);
    if (!device.empty() && (at == devices.end() || *at != device)) devices.insert(at, std::move(device));
  }
  return devices;
}

/// @param all  devices of the bus
Place PlaceOf(const Finding& finding, const AnalysisResult& result, const std::vector<std::string>& all) {
  const SlaveSummary* slave = result.slave(finding.slave);
  if (slave == nullptr) return {result.capture.file.path, all};
  std::string device = report::ProductText(slave->identity.vendor_id, slave->identity.product_code);
  return {result.capture.file.path, device.empty() ? std::vector<std::string>() : std::vector{std::move(device)}};
}

Place PlaceOf(const report::FindingDigest& finding, const report::CaptureDigest& capture) {
  if (!finding.slave) return {capture.path, capture.devices};
  return {capture.path, finding.product.empty() ? std::vector<std::string>() : std::vector{finding.product}};
}

/// Whether the capture could show what the entry accepts. A slave is one of several on the bus.
bool Concerns(const Acceptance& accepted, const report::CaptureDigest& capture) {
  if (IsFor(accepted, {capture.path, capture.devices})) return true;
  return std::ranges::any_of(accepted.devices, [&](const std::string& device) {
    return std::ranges::find(capture.devices, device) != capture.devices.end();
  });
}

/// Whether the rule ran: it is on, and it has an expectation if it compares with one. An unknown rule never runs, but
/// ExpiredEntries() reports that.
bool Ran(std::string_view rule, const report::CaptureDigest& capture) {
  const auto is_off = [rule](const auto& setting) { return setting.first == rule && setting.second == "off"; };
  if (std::ranges::any_of(capture.rules, is_off)) return false;
  const RuleInfo* const info = FindRule(rule);
  if (capture.coverage.empty() || info == nullptr) return true;  // a report of the first versions
  const auto of_rule =
      std::ranges::find_if(capture.coverage, [rule](const auto& coverage) { return coverage.rule == rule; });
  // `startup` leaves out all rules but its own.
  if (of_rule == capture.coverage.end()) return false;
  return SubjectOf(*info) != Subject::kExpectation || of_rule->count.applicable() > 0;
}

/// Of rules that did not run nothing is known: their entries stay.
void KeepOfOtherRules(std::span<const report::CaptureDigest> captures, const Baseline& before, Baseline& all) {
  for (const auto& [fingerprint, accepted] : before) {
    const auto is_open = [&rule = fingerprint.rule, &entry = accepted](const report::CaptureDigest& capture) {
      return Concerns(entry, capture) && !Ran(rule, capture);
    };
    if (std::ranges::none_of(captures, is_open)) continue;
    const auto [begin, end] = all.equal_range(fingerprint);
    const bool listed = std::any_of(begin, end, [&entry = accepted](const auto& other) {
      return other.second.devices == entry.devices && other.second.captures == entry.captures;
    });
    if (!listed) all.emplace(fingerprint, accepted);
  }
}

std::string Named(const Fingerprint& fingerprint, const SlaveNames& names) {
  return fingerprint.rule + " of " + (fingerprint.slave ? names.Of(*fingerprint.slave) : std::string("the bus"));
}

std::string Write(const Baseline& all) {
  return report::JsonDocumentText([&](report::JsonObject& out) {
    out.Put("schema", kBaselineSchema);
    out.List("findings", all, [](report::JsonObject& json, const Baseline::value_type& entry) {
      json.Put("rule", entry.first.rule);
      json.Put("slave", entry.first.slave);
      json.Text("identity", entry.first.identity);
      json.Text("title", entry.second.title);
      if (!entry.second.devices.empty()) json.Texts("devices", entry.second.devices);
      if (!entry.second.captures.empty()) json.Texts("captures", entry.second.captures);
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
          "'devices' and 'captures' (lists of texts), 'reason' and 'expires' (\"2026-12-31\")"};
    }
    baseline.insert(std::move(*read));
  }
  return baseline;
}

std::string WriteBaseline(const report::Report& report, const Baseline& before) {
  Baseline all;
  for (const report::CaptureReport& capture : report.captures) {
    const std::vector<std::string> devices = DevicesOf(capture.result);
    for (const Finding& finding : capture.result.findings) {
      Add(FingerprintOf(finding, capture.result), report::TitleOf(finding), PlaceOf(finding, capture.result, devices),
          before, all);
    }
  }
  KeepOfOtherRules(report::DigestOf(report).captures, before, all);
  return Write(all);
}

std::string WriteBaseline(const report::Digest& digest, const Baseline& before) {
  Baseline all;
  for (const report::CaptureDigest& capture : digest.captures) {
    for (const report::FindingDigest& finding : capture.findings) {
      Add(report::FingerprintOf(finding), finding.title, PlaceOf(finding, capture), before, all);
    }
  }
  KeepOfOtherRules(digest.captures, before, all);
  return Write(all);
}

Baseline BaselineBefore(const std::string& path) {
  if (!system::IsFile(path)) return {};
  Result<Baseline> before = ReadBaseline(path);
  return before ? std::move(*before) : Baseline{};
}

std::vector<std::string> ExpiredEntries(const Baseline& baseline) {
  std::vector<std::string> texts;
  std::size_t by_title = 0;
  for (const auto& [fingerprint, accepted] : baseline) {
    if (accepted.by_title) ++by_title;
    if (FindRule(fingerprint.rule) == nullptr) {
      std::vector<std::string_view> ids;
      for (const RuleInfo* rule : RuleCatalogue()) ids.push_back(rule->id);
      texts.push_back("'" + report::OneLine(fingerprint.rule) + "' is no rule" +
                      Suggestion(fingerprint.rule, ids, "ecaudit rules"));
    }
    if (!accepted.expired || accepted.by_title) continue;
    texts.push_back(Named(fingerprint, {}) + " was accepted until " + accepted.expires + " only, and counts again" +
                    (accepted.reason.empty() ? "" : " (" + accepted.reason + ")"));
  }
  if (by_title > 0) {
    texts.push_back(Count(by_title, "entry", "entries") +
                    " without an identity match no finding: write the baseline again with --write-baseline");
  }
  return texts;
}

namespace {

/// The entry is of a slave that --slave left out, so the report does not show its device either.
bool IsOfHiddenSlave(const Fingerprint& fingerprint, const report::CaptureDigest& capture) {
  const std::vector<std::string>& shown = capture.selection.slaves;
  return fingerprint.slave && !shown.empty() &&
         std::ranges::find(shown, std::to_string(*fingerprint.slave)) == shown.end();
}

}  // namespace

std::vector<std::string> UnmatchedEntries(const Baseline& baseline,
                                          std::span<const report::CaptureDigest* const> captures) {
  std::set<const Acceptance*> matched;
  // A capture of which only a part is shown, or that could not be read, may have the findings of any entry for it.
  std::vector<const report::CaptureDigest*> partly;
  for (const report::CaptureDigest* capture : captures) {
    if (capture->selection != report::Selection{} || !capture->complete || !capture->unreadable.empty()) {
      partly.push_back(capture);
    }
    for (const report::FindingDigest& finding : capture->findings) {
      const auto [begin, end] = baseline.equal_range(report::FingerprintOf(finding));
      for (auto entry = begin; entry != end; ++entry) {
        if (IsFor(entry->second, PlaceOf(finding, *capture))) matched.insert(&entry->second);
      }
    }
  }
  constexpr std::size_t kNamed = 3;
  std::string named;
  std::size_t fixed = 0;
  std::size_t elsewhere = 0;
  std::size_t hidden = 0;  // may be there: nothing is known of them
  for (const auto& [fingerprint, accepted] : baseline) {
    if (accepted.expired || accepted.by_title || matched.contains(&accepted)) continue;
    const auto concerns = [&identity = fingerprint, &entry = accepted](const auto* capture) {
      return Concerns(entry, *capture) || IsOfHiddenSlave(identity, *capture);
    };
    if (std::ranges::none_of(captures, concerns)) {
      ++elsewhere;
      continue;
    }
    const auto is_open = [&rule = fingerprint.rule, &concerns](const auto* capture) {
      return concerns(capture) && !Ran(rule, *capture);
    };
    if (std::ranges::any_of(partly, concerns) || std::ranges::any_of(captures, is_open)) {
      ++hidden;
      continue;
    }
    if (fixed++ < kNamed)
      named += (named.empty() ? "" : ", ") +
               Named(fingerprint, captures.empty() ? SlaveNames{} : captures.front()->slave_names);
  }
  std::vector<std::string> texts;
  if (fixed > 0) {
    texts.push_back(Count(fixed, "entry", "entries") + (fixed == 1 ? " matches" : " match") + " no finding: " + named +
                    (fixed > kNamed ? ", ..." : ""));
  }
  // A file for many machines may be used for one of them; one that fits none of its captures is the wrong file.
  if (elsewhere > 0 && matched.empty() && fixed == 0 && hidden == 0) {
    texts.push_back(elsewhere == baseline.size()
                        ? "all entries are for other devices or captures"
                        : Count(elsewhere, "entry", "entries") + " for other devices or captures");
  }
  return texts;
}

std::string PatternOf(std::string_view capture) {
  std::string pattern;
  for (const char c : NameIn(capture)) {
    if (c >= '0' && c <= '9') {
      if (!pattern.ends_with('*')) pattern += '*';
    } else if (c == '*' || c == '?' || c == '[' || c == '\\') {
      pattern += std::string("\\") + c;
    } else {
      pattern += c;
    }
  }
  return pattern;
}

std::optional<Error> CheckBaselinePath(const std::string& path) {
  return CheckReplaced(path, kBaselineSchema, "a baseline");
}

void ApplyBaseline(const Baseline& baseline, report::CaptureReport& capture) {
  capture.known.clear();
  capture.known_because.clear();
  const std::vector<std::string> devices = DevicesOf(capture.result);
  for (const Finding& finding : capture.result.findings) {
    auto [known, because] =
        Lookup(baseline, FingerprintOf(finding, capture.result), PlaceOf(finding, capture.result, devices));
    capture.known.push_back(known);
    capture.known_because.push_back(std::move(because));
  }
}

void ApplyBaseline(const Baseline& baseline, report::CaptureDigest& capture) {
  for (report::FindingDigest& finding : capture.findings) {
    std::tie(finding.known, finding.known_because) =
        Lookup(baseline, report::FingerprintOf(finding), PlaceOf(finding, capture));
    finding.known_because = report::PrintableLines(finding.known_because);
  }
}

}  // namespace ecaudit::cli
