#pragma once

#include <string_view>

namespace ecaudit::cli {

/// As `ecaudit --version` prints it: "0.1.0".
[[nodiscard]] std::string_view Version();

}  // namespace ecaudit::cli
