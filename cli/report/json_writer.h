/// The report for programs: schema "ecaudit.report/1", described by ecaudit-report-1.schema.json beside this file.
#pragma once

#include <string>

#include "cli/report/json_text.h"
#include "cli/report/report.h"

namespace ecaudit::report {

/// What is not known is null; sections that are not analysed are absent. Control characters from the
/// capture appear as \xNN (Printable()), so that the document is safe on a terminal.
void PutReport(JsonObject& out, const Report& report);
/// The same as one UTF-8 document, indented, ended by a newline.
[[nodiscard]] std::string WriteJson(const Report& report);
/// The same piece by piece: reports of thousands of slaves are large.
void WriteJson(const Report& report, const TextSink& sink);

}  // namespace ecaudit::report
