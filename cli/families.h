/// The drive families that a command knows: the built-in ones, those of the system, those of `--profiles`.
#pragma once

#include <string>
#include <string_view>

#include "decoder/base/result.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {

/// Says that there is no family of that name, and which one may be meant.
[[nodiscard]] Error UnknownProfile(const device::ProfileRegistry& families, std::string_view name);

}  // namespace ecaudit::cli
