/// Whole files of others (settings, descriptions, reports): regular files only, never more bytes than allowed. A pipe
/// or a device would hang the program or never end.
#pragma once

#include <cstdint>
#include <string>

namespace ecaudit {

struct FileContent {
  enum class Outcome : std::uint8_t { kRead, kMissing, kFolder, kOtherKind, kTooLarge, kFailed };
  Outcome outcome = Outcome::kFailed;
  std::string text;
  int reason = 0;  ///< errno of kFailed
};

/// Reads `path`, links followed. @param largest  bytes it may have, also when it grows in between
[[nodiscard]] FileContent ReadRegularFile(const std::string& path, std::uintmax_t largest);

}  // namespace ecaudit
