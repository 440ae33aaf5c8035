/// The end of `batch` and `merge`: the same summary and exit status from the same reports.
#pragma once

#include <optional>
#include <string>

#include "cli/console.h"
#include "cli/exit_status.h"
#include "cli/report/digest.h"
#include "cli/report_output.h"

namespace ecaudit::cli {

/// By path; captures of one path by their report.
void SortCaptures(report::Digest& digest);

/// Names captures that could not be read on standard error, writes the summary and, when asked to, a baseline of all
/// findings.
/// @return 1 when a finding counts; 2 when a capture could not be read or was not reached, or an output fails
[[nodiscard]] ExitStatus Deliver(const report::Digest& digest, const ReportOutput& output,
                                 const std::optional<std::string>& write_baseline, Console& console);

}  // namespace ecaudit::cli
