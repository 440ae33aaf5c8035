/// `--esi` and `--eni`: reads the files that say which devices are on the bus.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/options/device_files.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Reads them all. Fails with "PATH: line 12, column 5: reason" on the first that cannot be used.
/// @return null when none is named
[[nodiscard]] Result<std::shared_ptr<const DeviceFiles>> LoadDeviceFiles(const std::vector<std::string>& esi,
                                                                         const std::optional<std::string>& eni);

}  // namespace ecaudit::cli
