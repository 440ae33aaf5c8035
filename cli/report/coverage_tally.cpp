#include "cli/report/coverage_tally.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "analyzers/result/every_slave.h"
#include "cli/report/layout.h"
#include "cli/report/report.h"
#include "cli/report/sentences.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// The order of the catalogue; a chapter that is new comes after them.
constexpr std::array<std::string_view, 10> kChapters{
    "Capture",         "Frame and bus", "AL state machine",      "Sync managers and FMMUs",
    "Mailbox and CoE", "PDO mapping",   "Drive profile (DS402)", "Synchronisation",
    "Latch",           "Start-up"};

}  // namespace

void CoverageCount::Add(Coverage coverage) {
  switch (coverage) {
    case Coverage::kJudged:
      ++judged;
      break;
    case Coverage::kPartly:
      ++partly;
      break;
    case Coverage::kNotJudged:
      ++not_judged;
      break;
    case Coverage::kNotApplicable:
      ++not_applicable;
      break;
  }
}

void CoverageCount::Add(const CoverageCount& other) {
  judged += other.judged;
  partly += other.partly;
  not_judged += other.not_judged;
  not_applicable += other.not_applicable;
}

CoverageCount CountOf(const RuleCoverage& rule) {
  CoverageCount count;
  for (const SlaveCoverage& slave : rule.slaves) count.Add(slave.coverage);
  return count;
}

CoverageCount CountOf(std::span<const RuleCoverage> rules) {
  CoverageCount count;
  for (const RuleCoverage& rule : rules) count.Add(CountOf(rule));
  return count;
}

std::uint64_t CountSwitchedOff(std::span<const RuleCoverage> rules) {
  std::uint64_t count = 0;
  for (const RuleCoverage& rule : rules) {
    for (const SlaveCoverage& slave : rule.slaves) {
      if (slave.coverage == Coverage::kNotApplicable && slave.why == NotApplicable::kSwitchedOff) ++count;
    }
  }
  return count;
}

std::vector<ChapterCoverage> ByChapter(std::span<const RuleCoverage> rules) {
  std::vector<ChapterCoverage> chapters;
  for (const std::string_view chapter : kChapters) chapters.push_back({chapter, {}});
  for (const RuleCoverage& rule : rules) {
    auto at =
        std::ranges::find_if(chapters, [&](const ChapterCoverage& chapter) { return chapter.chapter == rule.chapter; });
    if (at == chapters.end()) at = chapters.insert(chapters.end(), {rule.chapter, {}});
    at->count.Add(CountOf(rule));
  }
  std::erase_if(chapters, [](const ChapterCoverage& chapter) { return chapter.count == CoverageCount{}; });
  return chapters;
}

std::string_view Name(Coverage coverage) {
  static constexpr Named<Coverage> kNames[] = {
      {Coverage::kJudged, "judged"},
      {Coverage::kPartly, "partly"},
      {Coverage::kNotJudged, "not_judged"},
      {Coverage::kNotApplicable, "not_applicable"},
  };
  static_assert(NamesAll(kNames, Coverage::kNotApplicable));
  return NameIn(kNames, coverage);
}

std::string_view WhyNotApplicable(const RuleCoverage& rule) {
  for (const SlaveCoverage& slave : rule.slaves) {
    if (slave.coverage == Coverage::kNotApplicable) return Describe(slave.why);
  }
  return {};
}

std::string CoverageText(std::span<const RuleCoverage> rules) {
  const CoverageCount all = CountOf(rules);
  if (all == CoverageCount{}) return {};
  std::string text = Grouped(all.judged) + " of " + Grouped(all.applicable());
  if (all.partly > 0) text += ", " + Grouped(all.partly) + " in part";
  std::string chapters, without;
  for (const ChapterCoverage& chapter : ByChapter(rules)) {
    const CoverageCount& count = chapter.count;
    std::string& list = count.applicable() > 0 ? chapters : without;
    list += list.empty() ? "" : ", ";
    std::string name(chapter.chapter.substr(0, chapter.chapter.find(" (")));
    std::ranges::replace(name, ' ', kHardSpace);
    list += name;
    if (count.applicable() == 0) continue;
    list += kHardSpace + Grouped(count.judged) + "/" + Grouped(count.applicable());
  }
  if (!chapters.empty()) text += ": " + chapters;
  if (!without.empty()) text += "; not applicable: " + without;
  return text;
}

std::vector<MissingCount> WhatIsMissing(const AnalysisResult& result) {
  // A line holds for one slave, for the bus, or for all slaves alike.
  std::map<std::pair<std::string_view, SlaveId>, const NotEvaluable*> lines;
  for (const NotEvaluable& entry : result.not_evaluable) lines.try_emplace({entry.rule, entry.slave}, &entry);
  std::vector<MissingCount> missing;
  for (const RuleCoverage& rule : result.coverage) {
    for (const SlaveCoverage& slave : rule.slaves) {
      if (slave.coverage != Coverage::kNotJudged) continue;
      auto line = lines.find({rule.rule, slave.slave});
      if (line == lines.end()) line = lines.find({rule.rule, kEverySlave});
      if (line == lines.end()) line = lines.find({rule.rule, kNoSlave});
      if (line == lines.end()) continue;
      const Reason& reason = line->second->reason;
      const bool is_thing = reason.code == ReasonCode::kNotInCapture && reason.what != nullptr;
      const std::string what = is_thing ? std::string(reason.what->text) : TextOf(reason);
      const auto at = std::ranges::find_if(missing, [&](const auto& m) { return m.what == what; });
      if (at == missing.end()) {
        missing.push_back({what, 1});
      } else {
        ++at->checks;
      }
    }
  }
  std::ranges::stable_sort(missing, [](const MissingCount& a, const MissingCount& b) { return a.checks > b.checks; });
  return missing;
}

std::string CoverageSentence(const AnalysisResult& result) {
  constexpr std::size_t kNamed = 2;
  const CoverageCount count = CountOf(result.coverage);
  if (count.applicable() == 0) return {};
  std::string text = Grouped(count.judged) + " of " + Count(count.applicable(), "check") +
                     (count.applicable() == 1 ? " that concerns this bus" : " that concern this bus");
  if (count.partly > 0) text += ", " + Grouped(count.partly) + " more in part";
  if (count.not_judged == 0) return text;
  text += "; for " + Grouped(count.not_judged) + " the capture does not show enough";
  const std::vector<MissingCount> missing = WhatIsMissing(result);
  std::string list;
  std::uint64_t named = 0;
  for (std::size_t i = 0; i < missing.size() && i < kNamed; ++i) {
    list += (list.empty() ? "" : ", ") + OneLine(missing[i].what) + ": " + Grouped(missing[i].checks);
    named += missing[i].checks;
  }
  if (list.empty()) return text;
  if (named < count.not_judged) list += ", other: " + Grouped(count.not_judged - named);
  return text + " (" + list + ")";
}

bool IsJudged(const CoverageCount& count, std::uint64_t percent) {
  return count.judged * 100 >= count.applicable() * percent;
}

std::vector<Reservation> Reservations(bool misses_packets, bool limited, const CoverageCount& count) {
  std::vector<Reservation> reservations;
  if (misses_packets) reservations.push_back({"the capture misses packets", "the capture misses packets"});
  if (!limited && !IsJudged(count, kLeastJudgedPercent)) {
    reservations.push_back({"only " + PartWas(count.judged, count.applicable(), "evaluation") + " possible",
                            "only " + Grouped(count.judged) + " of " + Grouped(count.applicable()) + " evaluated"});
  }
  return reservations;
}

std::vector<std::string> TextsOf(const std::vector<Reservation>& reservations) {
  std::vector<std::string> texts;
  for (const Reservation& reservation : reservations) texts.push_back(reservation.text);
  return texts;
}

std::vector<Reservation> Reservations(const AnalysisResult& result) {
  const bool misses = std::ranges::any_of(
      result.not_evaluable, [](const auto& entry) { return entry.reason.code == ReasonCode::kMissesPackets; });
  return Reservations(misses, !WhyLimited(result).empty(), CountOf(result.coverage));
}

std::string WhyLimited(const AnalysisResult& result) {
  if (WithoutEtherCat(result)) return TextOf(Reason::Of(ReasonCode::kNoEtherCat));
  if (result.slaves.empty()) return TextOf(Reason::Of(ReasonCode::kNoSlave));
  std::set<unsigned> positions;
  std::string reason;
  for (const SlaveSummary& slave : result.slaves) {
    if (!slave.not_evaluated) continue;
    if (positions.empty()) reason = TextOf(*slave.not_evaluated);
    positions.insert(slave.position);
  }
  if (positions.empty()) return result.cut;
  return result.slave_names.Of(positions) + ": " + reason;
}

}  // namespace ecaudit::report
