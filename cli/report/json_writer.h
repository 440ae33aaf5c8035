/// The report for programs: schema "ecaudit.report/1", described by ecaudit-report-1.schema.json beside this file.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "cli/report/report.h"

namespace ecaudit::report {

/// What is not known is null; sections that are not analysed are absent. Control characters and invalid UTF-8 from the
/// capture appear as \xNN, so that the document is safe on a terminal.
[[nodiscard]] nlohmann::ordered_json ReportJson(const Report& report);
/// The same as one UTF-8 document, indented, ended by a newline.
[[nodiscard]] std::string WriteJson(const Report& report);

}  // namespace ecaudit::report
