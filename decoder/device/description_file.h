/// in: path of a file that describes devices (profile, ESI, ENI).  out: its text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "decoder/base/result.h"

namespace ecaudit::device {

/// Reads a regular file of at most `limit` bytes as a whole.
/// Fails with the path and one reason: not there, no file, too large, not readable.
[[nodiscard]] Result<std::string> ReadDescriptionFile(const std::filesystem::path& path, std::uintmax_t limit);

}  // namespace ecaudit::device
