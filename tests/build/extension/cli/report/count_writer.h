/// A format that tells a number: here only to show how formats are added.
#pragma once

#include <string>

#include "cli/report/report.h"
#include "cli/report/text_writer.h"

namespace ecaudit::report {

/// "3 findings in 1 capture".
[[nodiscard]] std::string WriteCount(const Report& report, const TextStyle& style);

}  // namespace ecaudit::report
