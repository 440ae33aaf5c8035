#include "cli/report_output.h"

#include "cli/output_file.h"

namespace ecaudit::cli {

Result<ReportOutput> ReportOutput::Plan(const OutputOptions& options, std::span<const std::string> captures) {
  std::vector<OutputFormat> formats;
  for (const report::Format& format : report::Formats()) formats.push_back({format.name, format.extension});
  Result<std::vector<OutputTarget>> targets = PlanOutputs(options, formats, captures);
  if (!targets) return targets.error();
  ReportOutput plan;
  plan.targets_ = std::move(*targets);
  plan.no_color_ = options.no_color;
  return plan;
}

std::optional<Error> ReportOutput::Write(const report::Report& report, Console& console) const {
  for (const OutputTarget& target : targets_) {
    const report::TextStyle style{target.standard() && console.color() && !no_color_};
    const std::string text = report::Formats()[target.format].write(report, style);
    if (auto error = target.standard() ? console.Write(text) : WriteOutputFile(target.path, text)) return error;
  }
  return std::nullopt;
}

}  // namespace ecaudit::cli
