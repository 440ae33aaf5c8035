/// One drive family, as `ecaudit profiles NAME` shows it.
#pragma once

#include <string>

#include "decoder/device/device_description.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {

/// @param full  with a row for each object, emergency code and bit
[[nodiscard]] std::string ProfileText(const device::DeviceDescription& profile, bool full, bool color);
/// Schema "ecaudit.profile-page/1": the profile's file, then those it extends, each as it was written. What one file
/// does not state is taken from the next.
[[nodiscard]] std::string ProfileJson(const device::DeviceDescription& profile,
                                      const device::ProfileRegistry& families);

}  // namespace ecaudit::cli
