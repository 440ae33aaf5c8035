/// Small JSON files that people write: configuration and baseline.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "decoder/base/json.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

inline constexpr std::uintmax_t kLargestWritten = 16U << 20U;  ///< bytes of a file that people write
inline constexpr std::uintmax_t kLargestReport = 1U << 30U;    ///< bytes of a report

/// Reads and parses `path`. In files that people write (`largest` as by default) no object may have a key twice.
/// @param largest  bytes it may have
/// @return the document, or one line: "x.json:3:14: not valid JSON"
[[nodiscard]] Result<JsonDocument> ReadJsonFile(const std::string& path, std::uintmax_t largest = kLargestWritten);

/// The whole file; or one line with the reason.
[[nodiscard]] Result<std::string> ReadSmallFile(const std::string& path, std::uintmax_t largest = kLargestWritten);

/// What keeps a command from replacing `path` by a document of its own: a file that is there, not empty, and no
/// document of that schema.
/// @param noun  "expectation"
[[nodiscard]] std::optional<Error> CheckReplaced(const std::string& path, std::string_view schema,
                                                 std::string_view noun);

}  // namespace ecaudit::cli
