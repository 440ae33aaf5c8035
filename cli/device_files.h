/// `--esi`, `--eni` and `--profiles`: reads the files that describe the devices on the bus.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/options/device_files.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Reads them all. Fails with "PATH: line 12, column 5: reason" on the first that cannot be used.
/// @param esi       files, and folders whose *.xml files are taken as far as they are ESI files
/// @param families  as LoadFamilies()
/// @param skipped   gets the reasons why files of folders were left out
/// @return null when none is named, and the system has no families
[[nodiscard]] Result<std::shared_ptr<const DeviceFiles>> LoadDeviceFiles(const std::vector<std::string>& esi,
                                                                         const std::optional<std::string>& eni,
                                                                         const std::vector<std::string>& families,
                                                                         std::vector<std::string>& skipped);

}  // namespace ecaudit::cli
