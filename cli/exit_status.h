/// Exit status of the program; part of its public interface.
#pragma once

namespace ecaudit::cli {

enum class ExitStatus : int {
  kClean = 0,          ///< no finding at or above --fail-on, and none that keeps the master from what it requested
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
