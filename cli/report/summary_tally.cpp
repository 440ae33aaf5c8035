#include "cli/report/summary_tally.h"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "cli/report/fingerprint.h"
#include "decoder/base/names.h"

namespace ecaudit::report {
namespace {

/// Adds the findings of one capture.
void Add(const Digest& digest, std::size_t capture, std::map<std::string_view, RuleTally>& rules) {
  const std::vector<FindingDigest>& findings = digest.captures[capture].findings;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const FindingDigest& f = findings[i];
    if (f.known) continue;
    const auto [entry, first] = rules.try_emplace(f.rule, RuleTally{f.rule, f.severity, 0, 0, capture, i});
    RuleTally& tally = entry->second;
    ++tally.findings;
    tally.severity = std::max(tally.severity, f.severity);
    const bool seen_here = std::any_of(findings.begin(), findings.begin() + static_cast<std::ptrdiff_t>(i),
                                       [&f](const FindingDigest& g) { return !g.known && g.rule == f.rule; });
    if (!seen_here) ++tally.captures;
  }
}

/// Puts a capture to those of the same first cause.
void AddCause(const Digest& digest, std::size_t place,
              std::map<std::pair<std::string, std::string>, CauseGroup>& causes) {
  const CaptureDigest& capture = digest.captures[place];
  if (!capture.unreadable.empty() || !capture.judged) return;
  const std::optional<MainFinding> main = MainFindingOf(capture);
  if (!main) return;
  const FindingDigest& root = capture.findings[main->root];
  const Fingerprint fingerprint = FingerprintOf(root);
  const auto [entry, first] = causes.try_emplace({fingerprint.rule, fingerprint.identity});
  CauseGroup& group = entry->second;
  if (first) {
    group.rule = fingerprint.rule;
    group.identity = fingerprint.identity;
    group.title = root.title;
    group.example = main->root;
  }
  group.severity = std::max(group.severity, capture.findings[main->worst].severity);
  group.captures.push_back(place);
  if (!capture.first_time.empty()) {
    // ISO times of one form sort as text.
    if (group.first_time.empty() || capture.first_time < group.first_time) group.first_time = capture.first_time;
    group.last_time = std::max(group.last_time, capture.first_time);
  }
  const auto at = std::ranges::lower_bound(group.products, root.product);
  if (!root.product.empty() && (at == group.products.end() || *at != root.product)) {
    group.products.insert(at, root.product);
  }
}

}  // namespace

std::string_view Name(Status status) {
  static constexpr Named<Status> kNames[] = {
      {Status::kFail, "fail"},       {Status::kUnmet, "unmet"}, {Status::kUnreadable, "unreadable"},
      {Status::kLimited, "limited"}, {Status::kPass, "pass"},   {Status::kNothingToCheck, "nothing-to-check"},
  };
  static_assert(NamesAll(kNames, Status::kNothingToCheck));
  return NameIn(kNames, status);
}

Status StatusOf(const CaptureDigest& capture) {
  if (!capture.unreadable.empty()) return Status::kUnreadable;
  const Summary summary = Summarise(capture);
  if (summary.fail) return Status::kFail;
  if (summary.unmet) return Status::kUnmet;
  if (capture.without_ethercat) return Status::kNothingToCheck;
  return summary.limited ? Status::kLimited : Status::kPass;
}

Urgency UrgencyOf(const CaptureDigest& capture) {
  switch (StatusOf(capture)) {
    case Status::kFail:
      return Urgency::kFail;
    case Status::kUnmet:
      return Urgency::kUnmet;
    case Status::kUnreadable:
      return Urgency::kUnreadable;
    case Status::kLimited:
      return Urgency::kLimited;
    case Status::kNothingToCheck:
      return Urgency::kNothingToCheck;
    case Status::kPass:
      break;
  }
  const Summary summary = Summarise(capture);
  return summary.errors + summary.warnings + summary.infos > 0 ? Urgency::kFindings : Urgency::kNoFinding;
}

std::string_view Tally::Verdict(const Digest& digest) const {
  if (failed + unmet > 0) return "fail";
  if (unreadable > 0 || digest.not_reached > 0) return "incomplete";
  return limited > 0 ? "limited" : "pass";
}

Tally TallyOf(const Digest& digest) {
  Tally tally;
  std::map<std::string_view, RuleTally> rules;
  std::map<std::pair<std::string, std::string>, CauseGroup> causes;
  for (std::size_t i = 0; i < digest.captures.size(); ++i) {
    const CaptureDigest& capture = digest.captures[i];
    tally.findings.Add(Summarise(capture));
    switch (StatusOf(capture)) {
      case Status::kFail:
        ++tally.failed;
        break;
      case Status::kUnmet:
        ++tally.unmet;
        break;
      case Status::kLimited:
        ++tally.limited;
        break;
      case Status::kUnreadable:
        ++tally.unreadable;
        break;
      case Status::kPass:
        ++tally.passed;
        break;
      case Status::kNothingToCheck:
        ++tally.nothing_to_check;
        break;
    }
    Add(digest, i, rules);
    AddCause(digest, i, causes);
  }
  for (auto& [fingerprint, group] : causes) tally.causes.push_back(std::move(group));
  std::ranges::stable_sort(tally.causes, [](const CauseGroup& a, const CauseGroup& b) {
    return std::tuple(b.severity, b.captures.size()) < std::tuple(a.severity, a.captures.size());
  });
  for (auto& [rule, entry] : rules) tally.rules.push_back(entry);
  std::ranges::sort(tally.rules, [](const RuleTally& a, const RuleTally& b) {
    return std::tuple(b.severity, b.captures, std::string_view(a.rule)) <
           std::tuple(a.severity, a.captures, std::string_view(b.rule));
  });
  return tally;
}

}  // namespace ecaudit::report
