/// in: an error code of CiA 402 (603Fh, emergency).  out: what the standard calls it.
#pragma once

#include <cstdint>
#include <string_view>

namespace ecaudit {

/// Empty where the standard has no such code.
[[nodiscard]] std::string_view DriveErrorText(std::uint16_t code);

}  // namespace ecaudit
