/// Findings as workflow commands of GitHub Actions: annotations on the page of the job, without an upload.
#pragma once

#include <string>
#include <string_view>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// A line for each finding that is not known, capture by capture in the order of reading: "::error file=...". Then what
/// is required and missing, and captures that could not be read.
/// @param folder  of the job: paths are relative to it
[[nodiscard]] std::string WriteGithub(const Digest& digest, std::string_view folder);

}  // namespace ecaudit::report
