/// How much a finding weighs; what the caller sets for a rule, and what a report shows of a finding.
#pragma once

#include <cstdint>
#include <string_view>

namespace ecaudit {

enum class Severity : std::uint8_t { kInfo, kWarning, kError };

/// "error", "warning", "info" as in reports and options.
[[nodiscard]] constexpr std::string_view Name(Severity severity) {
  return severity == Severity::kError ? "error" : severity == Severity::kWarning ? "warning" : "info";
}

}  // namespace ecaudit
