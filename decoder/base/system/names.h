/// Names of files, and wildcards as a shell has them: * ? and [abc].
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ecaudit::system {

/// What follows the last separator of folders.
[[nodiscard]] std::string_view NameOf(std::string_view path);
[[nodiscard]] bool MatchesPattern(const std::string& name, const std::string& pattern);
/// The paths that exist, sorted. Names that begin with a dot match no wildcard at their beginning.
[[nodiscard]] std::vector<std::string> PathsMatching(const std::string& pattern);
/// Paths as they were typed, after what the shell of this system leaves to the program: on Windows wildcards become the
/// files that match. One that matches nothing stays.
[[nodiscard]] std::vector<std::string> TypedPaths(std::vector<std::string> typed);

}  // namespace ecaudit::system
