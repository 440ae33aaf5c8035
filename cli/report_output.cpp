#include "cli/report_output.h"

#include <algorithm>
#include <utility>

#include "cli/output_file.h"

namespace ecaudit::cli {

Result<ReportOutput> ReportOutput::Plan(const OutputOptions& options, CommandFiles& files) {
  const std::span<const report::Format> formats = report::Formats();
  return Plan(options, {formats.begin(), formats.end()}, files);
}

Result<ReportOutput> ReportOutput::PlanSummary(const OutputOptions& options, CommandFiles& files) {
  return Plan(options, report::SummaryFormats(), files);
}

Result<ReportOutput> ReportOutput::Plan(const OutputOptions& options, std::vector<report::Format> formats,
                                        CommandFiles& files) {
  std::vector<OutputFormat> names;
  for (const report::Format& format : formats) names.push_back({format.name, format.extension});
  Result<std::vector<OutputTarget>> targets = PlanOutputs(options, names, files);
  if (!targets) return targets.error();
  for (const OutputTarget& target : *targets) {
    const report::Format& format = formats[target.format];
    const std::string_view missing = format.missing == nullptr ? std::string_view() : format.missing();
    if (!missing.empty()) return Error{std::string(missing)};
  }
  ReportOutput plan;
  plan.formats_ = std::move(formats);
  plan.targets_ = std::move(*targets);
  plan.text_ = options.text;
  return plan;
}

bool ReportOutput::draws() const {
  return std::any_of(targets_.begin(), targets_.end(),
                     [this](const OutputTarget& target) { return formats_[target.format].draws; });
}

bool ReportOutput::lines() const {
  return std::any_of(targets_.begin(), targets_.end(),
                     [this](const OutputTarget& target) { return formats_[target.format].lines; });
}

template <typename Writer>
std::optional<Error> ReportOutput::WriteAll(Writer&& text_for, bool empty, Console& console) const {
  for (const OutputTarget& target : targets_) {
    if (empty && target.standard()) continue;
    const report::TextStyle style = text_.Style(console, target.standard());
    const std::string text = text_for(formats_[target.format], style);
    if (auto error = target.standard() ? console.Write(text) : WriteOutputFile(target.path, text)) return error;
  }
  return std::nullopt;
}

std::optional<Error> ReportOutput::Write(const report::Report& report, Console& console) const {
  return WriteAll(
      [&](const report::Format& format, const report::TextStyle& style) { return format.write(report, style); },
      report.captures.empty(), console);
}

std::optional<Error> ReportOutput::Write(const report::Digest& digest, Console& console) const {
  return WriteAll(
      [&](const report::Format& format, const report::TextStyle& style) { return format.write_summary(digest, style); },
      false, console);
}

}  // namespace ecaudit::cli
