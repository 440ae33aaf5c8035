/// Exit status of the program; part of its public interface.
#pragma once

#include <string_view>

namespace ecaudit::cli {

/// What the help states of it; commands add what else they have.
inline constexpr std::string_view kExitStatusHelp =
    "Exit status: 0 no finding at or above --fail-on, and none that keeps the master from something it requested;\n"
    "1 such a finding, or --require is not met; 2 wrong usage or unreadable input; ";

enum class ExitStatus : int {
  kClean = 0,          ///< no finding at or above --fail-on, and none that keeps the master from something it requested
  kFindings = 1,       ///< findings at or above it
  kUsage = 2,          ///< wrong usage, unreadable input, or output that cannot be written
  kInternal = 3,       ///< a bug in ecaudit
  kInterrupted = 130,  ///< ended by Ctrl-C or SIGTERM; what was found so far is delivered and marked incomplete
};

/// The one to exit with when several parts of the work ended differently.
[[nodiscard]] constexpr ExitStatus Worst(ExitStatus a, ExitStatus b) {
  return a < b ? b : a;
}

}  // namespace ecaudit::cli
