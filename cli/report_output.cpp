#include "cli/report_output.h"

#include <algorithm>
#include <utility>

#include "cli/output_file.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kText = 0;

}  // namespace

std::vector<OutputFormat> NamesOf(std::span<const report::Format> formats) {
  std::vector<OutputFormat> names;
  for (const report::Format& format : formats) names.push_back({format.name, format.extension});
  return names;
}

Result<ReportOutput> ReportOutput::Plan(const OutputOptions& options, CommandFiles& files) {
  const std::span<const report::Format> formats = report::Formats();
  return Plan(options, {formats.begin(), formats.end()}, files);
}

Result<ReportOutput> ReportOutput::PlanSummary(const OutputOptions& options, CommandFiles& files) {
  return Plan(options, report::SummaryFormats(), files);
}

Result<ReportOutput> ReportOutput::Plan(const OutputOptions& options, std::vector<report::Format> formats,
                                        CommandFiles& files) {
  Result<std::vector<OutputTarget>> targets = PlanOutputs(options, NamesOf(formats), files);
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
  return std::ranges::any_of(targets_, [this](const OutputTarget& target) { return formats_[target.format].draws; });
}

bool ReportOutput::lines() const {
  return std::ranges::any_of(targets_, [this](const OutputTarget& target) { return formats_[target.format].lines; });
}

namespace {

std::optional<Error> WriteTo(const OutputTarget& target, const std::string& text, Console& console) {
  return target.standard() ? console.Write(text) : WriteOutputFile(target.path, text);
}

/// A report that may be larger than all it was made from: no text of it is kept.
std::optional<Error> WritePieces(const OutputTarget& target, const report::Format& format, const report::Report& report,
                                 Console& console) {
  const auto write = [&](const report::TextSink& sink) { format.write_pieces(report, sink); };
  if (!target.standard()) return WriteOutputPieces(target.path, write);
  std::optional<Error> error;
  write([&](std::string_view piece) {
    if (!error) error = console.Write(piece);
  });
  return error;
}

}  // namespace

std::optional<Error> ReportOutput::Write(const report::Report& report, Console& console) const {
  for (const OutputTarget& target : targets_) {
    const report::Format& format = formats_[target.format];
    // The text would repeat the lines of standard error.
    if (report.captures.empty() && target.standard() && target.format == kText) continue;
    const report::TextStyle style = text_.Style(console, target.standard());
    if (auto error = format.write_pieces != nullptr ? WritePieces(target, format, report, console)
                                                    : WriteTo(target, format.write(report, style), console)) {
      return error;
    }
  }
  return std::nullopt;
}

std::optional<Error> ReportOutput::Write(const report::Digest& digest, Console& console) const {
  for (const OutputTarget& target : targets_) {
    const report::TextStyle style = text_.Style(console, target.standard());
    if (auto error = WriteTo(target, formats_[target.format].write_summary(digest, style), console)) return error;
  }
  return std::nullopt;
}

}  // namespace ecaudit::cli
