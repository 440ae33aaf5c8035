/// The drive families that a command knows: the built-in ones, those of the system, those of `--profiles`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/result.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {

/// The built-in families, those of the folder `share/ecaudit/profiles` beside the program's own, and those of the files
/// and folders in `paths`; of two with one id the later counts. Fails with "PATH: reason" on the first that cannot be
/// used.
[[nodiscard]] Result<device::ProfileRegistry> LoadFamilies(const std::vector<std::string>& paths);

/// Reports that there is no family of that name, and which one may be meant.
[[nodiscard]] Error UnknownProfile(const device::ProfileRegistry& families, std::string_view name);

}  // namespace ecaudit::cli
