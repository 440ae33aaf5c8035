/// The report formats by name: adding one is a writer and a line in formats.cpp.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "cli/report/report.h"
#include "cli/report/text_writer.h"

namespace ecaudit::report {

struct Format {
  std::string_view name;       ///< as in --format and -o FORMAT=PATH
  std::string_view extension;  ///< a file name with this ending gets the format when none is named
  std::string (*write)(const Report& report, const TextStyle& style);
};

/// The first one is the default.
[[nodiscard]] std::span<const Format> Formats();

}  // namespace ecaudit::report
