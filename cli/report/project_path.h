/// The path of a file as CI servers expect it: relative to the folder of the project.
#pragma once

#include <string>
#include <string_view>

namespace ecaudit::report {

/// `path` without what leads to `folder` (absolute; the working directory of a job), "./" and the like left out. What
/// lies elsewhere stays as it is.
[[nodiscard]] std::string PathInProject(std::string_view path, std::string_view folder);

}  // namespace ecaudit::report
