/// The one summary of many captures: what `batch` and `merge` write as text and as JSON.
#pragma once

#include <string>

#include "cli/report/digest.h"
#include "cli/report/text_writer.h"

namespace ecaudit::report {

/// For a person: the verdict, which rules found something in how many captures, then a line for each capture, those
/// that failed first. Captures without findings are counted, not listed, when there are many.
[[nodiscard]] std::string WriteSummaryText(const Digest& digest, const TextStyle& style);

/// For programs: schema "ecaudit.summary/1", described by ecaudit-summary-1.schema.json beside this file. UTF-8, one
/// document, indented, ended by a newline.
[[nodiscard]] std::string WriteSummaryJson(const Digest& digest);

}  // namespace ecaudit::report
