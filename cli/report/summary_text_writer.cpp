#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>

#include "cli/report/layout.h"
#include "cli/report/summary_tally.h"
#include "cli/report/summary_writer.h"
#include "cli/report/verdict_line.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// Captures without findings are listed up to this number.
constexpr std::size_t kQuietListed = 40;
constexpr std::size_t kConfigurationsListed = 20;

/// "9 captures, 3 failed: 5 errors, 2 warnings, 1 info; 1 could not be read"
std::string FirstLine(const Digest& digest, const Tally& tally) {
  const Summary& s = tally.findings;
  std::string text = Count(digest.captures.size(), "capture") + ", " +
                     (tally.failed > 0 ? Grouped(tally.failed) : "none") + " failed: ";
  text += Count(s.errors, "error") + ", " + Count(s.warnings, "warning") + ", " + Count(s.infos, "info");
  if (s.known > 0) text += ", " + Grouped(s.known) + " known from the baseline";
  if (tally.unmet > 0)
    text += "; " + Grouped(tally.unmet) + (tally.unmet == 1 ? " lacks" : " lack") + " what is required";
  if (tally.limited > 0) text += "; " + Grouped(tally.limited) + " limited";
  if (tally.unreadable > 0) text += "; " + Grouped(tally.unreadable) + " could not be read";
  if (tally.nothing_to_check > 0) text += "; " + Grouped(tally.nothing_to_check) + " without EtherCAT";
  if (digest.not_reached > 0) text += "; interrupted, " + Grouped(digest.not_reached) + " not checked";
  return text;
}

void Rules(const Digest& digest, const Tally& tally, TextBuilder& text) {
  if (tally.rules.empty()) return;
  std::size_t width = 0;
  for (const RuleTally& rule : tally.rules) width = std::max(width, rule.rule.size());
  text.Line();
  text.Line(text.Styled("Findings by rule", Style::kBold));
  for (const RuleTally& rule : tally.rules) {
    const CaptureDigest& capture = digest.captures[rule.first_capture];
    const FindingDigest& f = capture.findings[rule.first_finding];
    std::string numbers = Count(rule.captures, "capture");
    if (rule.findings != rule.captures) numbers += ", " + Count(rule.findings, "finding");
    std::string name(Name(rule.severity));
    name.resize(std::max<std::size_t>(name.size(), 7), ' ');
    std::string id = rule.rule;
    id.resize(std::max(id.size(), width), ' ');
    text.Line(text.Styled(name, StyleOf(rule.severity)) + "  " + id + "  " + numbers, 2);
    std::string example = "e.g. " + OneLine(capture.path);
    if (f.frame != 0) example += " frame " + std::to_string(f.frame);
    text.Paragraph(example + ": " + f.place + ": " + OneLine(f.title), 11, 13);
  }
}

/// Groups of captures that are reported.
constexpr std::size_t kCausesShown = 20;

/// "37 captures: error al-refused: SAFEOP refused ...; first seen 2026-03-02; slaves of ..."
void Causes(const Digest& digest, const Tally& tally, TextBuilder& text) {
  const auto shared = [](const CauseGroup& group) { return group.captures.size() > 1; };
  if (std::ranges::none_of(tally.causes, shared)) return;
  text.Line();
  text.Line(text.Styled("The same first cause in several captures", Style::kBold));
  std::size_t shown = 0;
  for (const CauseGroup& group : tally.causes) {
    if (!shared(group)) continue;
    if (++shown > kCausesShown) {
      text.Line("and more (--format json has all)", 2);
      break;
    }
    const CaptureDigest& first = digest.captures[group.captures.front()];
    std::string line = Count(group.captures.size(), "capture") + ": " + std::string(Name(group.severity)) + " " +
                       group.rule + ": " + OneLine(first.findings[group.example].title);
    if (!group.first_time.empty()) {
      const std::string day = group.first_time.substr(0, 10);
      const std::string last = group.last_time.substr(0, 10);
      line += day == last ? "; seen " + day : "; first seen " + day + ", last " + last;
    }
    for (std::size_t i = 0; i < group.products.size(); ++i) {
      line += (i == 0 ? "; slaves of " : " and ") + group.products[i];
    }
    text.Paragraph(line + "; e.g. " + OneLine(first.path), 2, 6);
  }
}

/// By urgency.
constexpr std::array kStyles{Style::kError,   Style::kError,   Style::kError, Style::kWarning,
                             Style::kWarning, Style::kWarning, Style::kGood};
static_assert(kStyles.size() == static_cast<std::size_t>(Urgency::kNoFinding) + 1);

void Captures(const Digest& digest, const TextStyle& style, TextBuilder& text) {
  if (digest.captures.empty()) return;
  std::array<std::vector<const CaptureDigest*>, kStyles.size()> ranks;
  for (const CaptureDigest& capture : digest.captures)
    ranks[static_cast<std::size_t>(UrgencyOf(capture))].push_back(&capture);
  if (!style.quiet) text.Line();
  if (!style.quiet) text.Line(text.Styled("Captures", Style::kBold));
  const std::size_t indent = style.quiet ? 0 : 2;
  for (std::size_t rank = 0; rank < ranks.size(); ++rank) {
    if (rank == static_cast<std::size_t>(Urgency::kNoFinding) && ranks[rank].size() > kQuietListed && !style.quiet) {
      text.Line("and " + Count(ranks[rank].size(), "capture") + " without findings", 2);
      continue;
    }
    for (const CaptureDigest* capture : ranks[rank]) {
      VerdictLine line = VerdictLineOf(*capture, style, true);
      for (const std::string& note : VerdictNotes(*capture)) {
        if (line.rest.find(note) == std::string::npos) line.rest += "; " + note;
      }
      text.Line(text.Styled(line.word, kStyles[rank]) + line.rest, indent);
    }
  }
}

/// Files that change the result and were not named on the command line.
void Configurations(const Digest& digest, TextBuilder& text) {
  std::map<std::string, std::size_t> captures;
  for (const CaptureDigest& capture : digest.captures) {
    if (!capture.config.empty()) ++captures[capture.config];
  }
  if (captures.empty()) return;
  text.Line();
  text.Line(text.Styled("Configuration files", Style::kBold));
  std::size_t shown = 0;
  for (const auto& [config, count] : captures) {
    if (shown++ == kConfigurationsListed) {
      text.Line("and " + Grouped(captures.size() - kConfigurationsListed) + " more", 2);
      break;
    }
    text.Line(OneLine(config) + ": " + Count(count, "capture"), 2);
  }
}

}  // namespace

std::string WriteSummaryText(const Digest& digest, const TextStyle& style) {
  TextBuilder text(style);
  const Tally tally = TallyOf(digest);
  const std::string_view verdict = tally.Verdict(digest);
  const std::string word = verdict == "fail"      ? "FAIL"
                           : verdict == "pass"    ? "PASS"
                           : verdict == "limited" ? "LIMITED"
                                                  : "INCOMPLETE";
  const Style shown = verdict == "pass" ? Style::kGood : verdict == "limited" ? Style::kWarning : Style::kError;
  text.Line(text.Styled(word, shown) + " " + FirstLine(digest, tally));
  if (!style.quiet) Causes(digest, tally, text);
  if (!style.quiet) Rules(digest, tally, text);
  Captures(digest, style, text);
  if (!style.quiet) Configurations(digest, text);
  return text.Take();
}

}  // namespace ecaudit::report
