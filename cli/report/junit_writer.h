/// The report for CI servers: JUnit XML as Jenkins, GitLab and GitHub's test reporters read it.
#pragma once

#include <string>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// One test suite a capture. Its test cases:
///   RULE                 passed, or skipped with the reason when the rule could not be evaluated (for some slave) or
///   is
///                        switched off
///   RULE, slave 0 (...)  failed: findings that count by --fail-on; all findings of that rule at that slave
///   capture can be read  with an error, instead of all others, when it cannot
/// Findings that do not count (milder ones, known ones) stand in the suite's output. Names do not depend on frames,
/// times or counts, so a CI server recognises a test case from run to run. Times are 0: they would differ each run.
[[nodiscard]] std::string WriteJunit(const Digest& digest);

}  // namespace ecaudit::report
