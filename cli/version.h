#pragma once

#include <string>
#include <string_view>

namespace ecaudit::cli {

/// As reports name it: "0.1.0".
[[nodiscard]] std::string_view Version();
/// The page of `ecaudit --version`: version, commit, compiler and libraries, as a report of a bug needs them.
[[nodiscard]] std::string VersionPage();

}  // namespace ecaudit::cli
