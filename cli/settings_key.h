/// Checks whether a report was made in the way it would be made now.
#pragma once

#include <span>
#include <string>

#include "cli/capture_options.h"
#include "cli/report/report.h"

namespace ecaudit::cli {

/// Hash of everything but the capture that a report depends on: version and catalogue of the program, settings, and the
/// content of baseline, ESI and ENI files. 16 hexadecimal digits.
[[nodiscard]] std::string SettingsKey(const Settings& settings);

/// Size and time of last change of a capture beside `settings_key`; zeros if the file does not give them.
/// @param files  the capture, or the files of one ring buffer: their sizes together, and the latest change
[[nodiscard]] report::Origin OriginOf(std::span<const std::string> files, const std::string& settings_key);

}  // namespace ecaudit::cli
