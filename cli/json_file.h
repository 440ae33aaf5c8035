/// Small JSON files that people write: configuration and baseline.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Reads and parses `path`, at most 16 MiB.
/// @return the document, or one line: "x.json:3:14: not valid JSON"
[[nodiscard]] Result<nlohmann::json> ReadJsonFile(const std::string& path);

/// The whole file; or one line saying why not.
[[nodiscard]] Result<std::string> ReadSmallFile(const std::string& path);

}  // namespace ecaudit::cli
