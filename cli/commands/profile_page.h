/// One drive family, as `ecaudit profiles NAME` shows it.
#pragma once

#include <string>

#include "decoder/device/device_description.h"

namespace ecaudit::cli {

[[nodiscard]] std::string ProfileText(const device::DeviceDescription& profile, bool color);
/// Schema "ecaudit.profile-page/1": all facts, with those of the profiles it extends, each with its source.
[[nodiscard]] std::string ProfileJson(const device::DeviceDescription& profile);

}  // namespace ecaudit::cli
