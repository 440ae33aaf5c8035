/// Reports into files: whole or not at all, and never over a capture.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Asks, before any work, whether a report can go to `path`: its folder exists, it is no folder itself, and it is no
/// capture (whatever its name).
/// @return what is in the way, or nothing
[[nodiscard]] std::optional<Error> CheckOutputPath(const std::string& path);

/// Writes `content` to a temporary file beside `path` and renames it, so that readers see the old report or the new
/// one. Links are followed; a device or pipe is written directly.
[[nodiscard]] std::optional<Error> WriteOutputFile(const std::string& path, std::string_view content);

}  // namespace ecaudit::cli
