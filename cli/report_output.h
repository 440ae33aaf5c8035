/// Where reports go: standard output, and the files of -o.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "cli/console.h"
#include "cli/output_plan.h"
#include "cli/report/formats.h"
#include "cli/report/report.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Their names and endings, for OutputOptions.
[[nodiscard]] std::vector<OutputFormat> NamesOf(std::span<const report::Format> formats);

/// The reports of one run.
class ReportOutput {
 public:
  /// Reads the options and asks whether every file can be written, before any work is done.
  /// @param files  of the command line: what is read is known to them; what is written is added
  [[nodiscard]] static Result<ReportOutput> Plan(const OutputOptions& options, CommandFiles& files);

  /// The same with other formats, the default first.
  [[nodiscard]] static Result<ReportOutput> Plan(const OutputOptions& options, std::vector<report::Format> formats,
                                                 CommandFiles& files);

  /// The same for the summary of many captures, with the formats that have one.
  [[nodiscard]] static Result<ReportOutput> PlanSummary(const OutputOptions& options, CommandFiles& files);

  /// One of the formats shows what the analysis collects over time.
  [[nodiscard]] bool draws() const;
  /// One of the formats names lines of the text of `decode`.
  [[nodiscard]] bool lines() const;

  /// Files first, standard output last, so that a closed pipe costs nothing. When no capture could be read, all of
  /// them show so; only the text leaves standard output empty, since standard error has the same lines.
  [[nodiscard]] std::optional<Error> Write(const report::Report& report, Console& console) const;
  [[nodiscard]] std::optional<Error> Write(const report::Digest& digest, Console& console) const;

 private:
  std::vector<report::Format> formats_;
  std::vector<OutputTarget> targets_;
  TextOptions text_;
};

}  // namespace ecaudit::cli
