#include "cli/capture_check.h"

#include <memory>
#include <utility>

#include "analyzers/analysis.h"
#include "analyzers/result/timeline.h"
#include "cli/crash.h"
#include "cli/decode_lines.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "cli/report/layout.h"
#include "cli/slave_filter.h"
#include "cli/window.h"

namespace ecaudit::cli {

std::optional<Error> BaselineShelf::Load(const std::string& path) {
  if (path.empty() || baselines_.contains(path)) return std::nullopt;
  Result<Baseline> baseline = ReadBaseline(path);
  if (!baseline) return baseline.error();
  baselines_.emplace(path, std::move(*baseline));
  return std::nullopt;
}

const Baseline* BaselineShelf::Find(const std::string& path) const {
  const auto baseline = baselines_.find(path);
  return baseline == baselines_.end() ? nullptr : &baseline->second;
}

void BaselineShelf::WarnOfExpired(Console& console) {
  if (warned_) return;
  warned_ = true;
  for (const auto& [path, baseline] : baselines_) {
    for (const std::string& text : ExpiredEntries(baseline)) console.Warning(path + ": " + text);
  }
}

void BaselineShelf::WarnOfUnmatched(const std::vector<report::CaptureDigest>& captures, Console& console) const {
  for (const auto& [path, baseline] : baselines_) {
    std::vector<const report::CaptureDigest*> compared;
    for (const report::CaptureDigest& capture : captures) {
      if (capture.baseline == report::PrintableLines(path)) compared.push_back(&capture);
    }
    if (compared.empty()) continue;
    for (const std::string& text : UnmatchedEntries(baseline, compared)) console.Warning(path + ": " + text);
  }
}

Error EmptyRange(const std::string& capture, report::Selection selection) {
  selection.slaves.clear();
  return Error{capture + ": no packet of the capture lies in the range " + Text(selection)};
}

Result<CheckedCapture> CheckCapture(std::span<const std::string> paths, const Settings& settings,
                                    const Baseline* baseline, const std::atomic<bool>& stop,
                                    std::function<void(std::uint64_t, std::uint64_t, std::uint64_t)> progress,
                                    const WantedExtras& wanted, std::atomic<FrameNo>* reached) {
  AnalysisOptions analysis = settings.analysis;
  CheckedCapture out;
  if (settings.moments.needs_capture()) {
    if (auto error = PlaceMoments(settings.moments, paths, analysis, &out.notices)) return *error;
  }
  const FrameRange range{analysis.from_s, analysis.to_s, analysis.from_frame, analysis.to_frame};
  report::Selection& selection = out.report.selection;
  selection = {range.from_s, range.to_s,          range.from_frame,     range.to_frame,
               {},           analysis.interfaces, settings.isolated_by, {}};
  auto source = CapturePaths({paths.begin(), paths.end()}, analysis.interfaces).Open(&stop);
  if (!source) return source.error();
  LineCounter* lines = nullptr;
  // The text of `decode` holds the packets of all interfaces.
  if (wanted.decode_lines && analysis.interfaces.empty()) {
    auto counting = std::make_unique<LineCounter>(std::move(*source));
    lines = counting.get();
    *source = std::move(counting);
  }
  WindowSource* window = nullptr;
  if (selection.range() && settings.isolated_by.empty()) {
    auto watched = std::make_unique<WindowSource>(std::move(*source), range);
    window = watched.get();
    *source = std::move(watched);
    // What is true of the window may rest on what came before it.
    analysis.from_s = analysis.to_s = std::nullopt;
    analysis.from_frame = analysis.to_frame = std::nullopt;
  }
  analysis.stop = &stop;
  analysis.reached = reached;
  analysis.progress = std::move(progress);
  if (wanted.timeline) {
    auto timeline = std::make_shared<Timeline>();
    out.report.result = Analyse(**source, analysis, timeline.get());
    out.report.timeline = std::move(timeline);
  } else {
    out.report.result = Analyse(**source, analysis);
  }
  for (const SlaveSelector& slave : settings.slaves)
    selection.slaves.push_back(NameOf(slave, settings.analysis.slave_names));
  const CaptureSummary& read = out.report.result.capture;
  const bool nothing = window != nullptr ? !window->reached() : read.packets == 0;
  if (nothing && read.file.packets > 0 && selection.leaves_out() && !stop) {
    return EmptyRange(paths.front(), selection);
  }
  out.report.fail_on = settings.fail_on;
  out.report.config = settings.config;
  out.report.baseline = settings.baseline;
  out.report.rules = RuleSettingTexts(settings.analysis);
  if (!report::WithoutEtherCat(out.report.result)) out.unmet = UnmetSlaves(settings.analysis, out.report.result);
  if (!report::WithoutEtherCat(out.report.result)) out.missing = MissingSlaves(settings.slaves, out.report.result);
  const std::size_t slaves = out.report.result.slaves.size();
  if (const std::string there = SlavesThere(out.report.result); !settings.slaves.empty() && !there.empty()) {
    out.slaves_there = "slaves count from " + out.report.result.slave_names.Number(0) + ", and there is " + there;
  }
  out.lacks_slave = !report::WithoutEtherCat(out.report.result) &&
                    KeepSlaves(settings.slaves, out.report.result) == 0 && !settings.slaves.empty();
  if (out.lacks_slave) out.missing.clear();
  if (window != nullptr) selection.outside = KeepWindow(window->first(), window->last(), out.report.result);
  out.report.required = settings.required.text;
  if (settings.required.any()) {
    out.report.unmet = MissingOf(settings.required, out.report.result, slaves, !settings.slaves.empty());
  }
  if (baseline != nullptr) ApplyBaseline(*baseline, out.report);
  if (lines != nullptr && !stop) out.report.decode_lines = DecodeLines(*lines, paths, out.report.result.findings);
  return out;
}

std::optional<Error> PlaceMoments(Settings& settings, const CapturePaths& paths, Console& console) {
  if (!settings.moments.needs_capture()) return std::nullopt;
  std::vector<std::string> notices;
  if (const auto error = PlaceMoments(settings.moments, paths.paths(), settings.analysis, &notices)) {
    return paths.WithoutSpools(*error);
  }
  for (const std::string& notice : notices) console.Warning(paths.WithoutSpools(Error{notice}).message);
  return std::nullopt;
}

Result<AnalysisResult> EvaluateWhole(const CaptureOptions& capture, const Settings& settings, const CapturePaths& paths,
                                     const std::string& label, Console& console) {
  AnalysisOptions analysis = settings.analysis;
  analysis.from_s = analysis.to_s = std::nullopt;
  analysis.from_frame = analysis.to_frame = std::nullopt;
  analysis.stop = &InterruptFlag();
  analysis.reached = &ReachedFrame();
  auto source = paths.Open();
  if (!source) return source.error();
  Progress progress(console, label);
  analysis.progress = [&progress](std::uint64_t done, std::uint64_t total, std::uint64_t packets) {
    progress.Update(done, total, packets);
  };
  AnalysisResult result = Analyse(**source, analysis);
  progress.Clear();
  if (InterruptFlag()) return result;
  const std::string& name = capture.captures.front();
  if (KeepSlaves(settings.slaves, result) == 0 && !settings.slaves.empty()) {
    return Error{name + " has no slave " + capture.slaves.front()};
  }
  if (result.capture.file.damage) console.Warning(name + " is damaged: " + result.capture.file.damage->message);
  return result;
}

}  // namespace ecaudit::cli
