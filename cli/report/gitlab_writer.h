/// Findings as GitLab's code quality report: in the widget of a merge request, and in the diff.
#pragma once

#include <string>
#include <string_view>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// A JSON array with an object for each finding that is not known, and for each capture that could not be read.
/// @param folder  of the job: paths are relative to it
[[nodiscard]] std::string WriteGitlab(const Digest& digest, std::string_view folder);

}  // namespace ecaudit::report
