#include "cli/copy/evidence_comments.h"

#include <algorithm>
#include <charconv>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/rule_info.h"
#include "cli/report/finding_id.h"
#include "cli/report/sentences.h"
#include "cli/report/text_writer.h"
#include "cli/suggest.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string InFrame(FrameNo frame) {
  return "frame " + std::to_string(frame);
}

/// "f1 error al-refused, slave 0 (0x1001): title".
std::string Head(const AnalysisResult& result, std::size_t index) {
  const Finding& f = result.findings[index];
  return report::FindingId(result, static_cast<FindingIndex>(index)) + " " + std::string(Name(f.severity)) + " " +
         std::string(f.rule) + ", " + report::SlaveLabel(result, f.slave) + ": " + report::TitleOf(f);
}

std::string FullText(const AnalysisResult& result, std::size_t index) {
  const Finding& f = result.findings[index];
  std::string text = InFrame(f.first.number) + ": " + Head(result, index);
  if (const std::string message = report::MessageOf(f, result); !message.empty()) text += "\n" + message;
  if (f.caused_by < result.findings.size()) {
    text += "\nConsequence of " + Head(result, f.caused_by);
    const FrameNo frame = result.findings[f.caused_by].first.number;
    if (frame != 0) text += " (" + InFrame(frame) + ")";
  }
  if (f.count > 1) text += "\n" + Grouped(f.count) + " times, last in " + InFrame(f.last.number);
  if (f.confidence == Confidence::kInferred) text += "\nInferred: rests on an assumption, which the text names";
  if (!f.reference.document.empty()) {
    text += "\nSee " + Printable(f.reference.document);
    if (!f.reference.section.empty()) text += ", " + Printable(f.reference.section);
  }
  return text;
}

/// Of the finding with this number; the end where there is none.
std::size_t PlaceOf(const AnalysisResult& result, std::size_t number) {
  std::size_t index = 0;
  while (index < result.findings.size() && result.NumberOf(static_cast<FindingIndex>(index)) != number) ++index;
  return index;
}

/// "the report has f1 to f4", "the report has f2 and f5". Numbers of a part of the capture have gaps.
std::string FindingsThere(const AnalysisResult& result) {
  constexpr std::size_t kNamed = 8;
  std::vector<std::uint32_t> numbers;
  for (FindingIndex i = 0; i < result.findings.size(); ++i) numbers.push_back(result.NumberOf(i));
  if (numbers.empty()) return "the report has none";
  std::ranges::sort(numbers);
  const auto id = [](std::uint32_t number) { return "f" + std::to_string(number); };
  if (numbers.size() == 1) return "the report has " + id(numbers.front());
  if (numbers.back() - numbers.front() + 1 == numbers.size()) {
    return "the report has " + id(numbers.front()) + " to " + id(numbers.back());
  }
  std::string text = "the report has ";
  for (std::size_t i = 0; i < numbers.size() && i < kNamed; ++i) text += (i > 0 ? ", " : "") + id(numbers[i]);
  if (numbers.size() > kNamed) text += " and " + std::to_string(numbers.size() - kNamed) + " more";
  return text;
}

}  // namespace

FrameComments CommentsOf(const AnalysisResult& result) {
  FrameComments comments;
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    const Finding& f = result.findings[i];
    if (!f.first.seen()) continue;
    comments[f.first.number].push_back(FullText(result, i));
    const std::string see = Head(result, i) + " (" + InFrame(f.first.number) + ")";
    if (f.last.seen() && f.last.number != f.first.number) {
      comments[f.last.number].push_back(InFrame(f.last.number) + ": last of " + Grouped(f.count) + " times: " + see);
    }
    for (const FrameNo related : f.related_frames) {
      if (related == 0 || related == f.first.number || related == f.last.number) continue;
      comments[related].push_back(InFrame(related) + ": belongs to " + see);
    }
  }
  return comments;
}

Result<std::vector<std::size_t>> FindingsNamed(const AnalysisResult& result, const std::vector<std::string>& names) {
  std::vector<std::size_t> found;
  for (const std::string& name : names) {
    std::size_t number = 0;
    const char* const end = name.data() + name.size();
    const bool is_id = name.size() > 1 && name[0] == 'f' &&
                       std::from_chars(name.data() + 1, end, number) == std::from_chars_result{end, std::errc()};
    if (is_id) {
      const std::size_t index = PlaceOf(result, number);
      if (index == result.findings.size()) return Error{"there is no finding " + name + "; " + FindingsThere(result)};
      found.push_back(index);
      continue;
    }
    if (FindRule(name) == nullptr) {
      std::vector<std::string_view> rules;
      for (const RuleInfo* rule : RuleCatalogue()) rules.push_back(rule->id);
      return Error{"'" + Printable(name) + "' is no finding such as f1 and no rule" +
                   Suggestion(name, rules, "ecaudit rules")};
    }
    const std::size_t before = found.size();
    for (std::size_t i = 0; i < result.findings.size(); ++i) {
      if (result.findings[i].rule == name) found.push_back(i);
    }
    if (found.size() == before) return Error{"there is no finding of rule " + name};
  }
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

std::vector<FrameNo> EvidenceFrames(const AnalysisResult& result, std::size_t finding) {
  std::vector<FrameNo> frames;
  std::vector<bool> seen(result.findings.size());
  for (std::size_t at = finding; at < result.findings.size() && !seen[at]; at = result.findings[at].caused_by) {
    seen[at] = true;
    const Finding& f = result.findings[at];
    frames.push_back(f.first.number);
    frames.push_back(f.last.number);
    frames.insert(frames.end(), f.related_frames.begin(), f.related_frames.end());
  }
  std::ranges::sort(frames);
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  std::erase(frames, FrameNo{0});
  return frames;
}

std::string FindingsWithoutFrame(const AnalysisResult& result) {
  std::string text;
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    if (result.findings[i].first.seen()) continue;
    text += (text.empty() ? "" : "\n") + Head(result, i);
  }
  return text;
}

}  // namespace ecaudit::cli
