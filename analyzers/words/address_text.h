/// Ethernet addresses as frames hand them out (wire::FrameView::source_mac()), in words.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "decoder/base/text.h"

namespace ecaudit {

/// "01:02:03:04:05:06". @param mac  the first byte of the address in bits 40 to 47
[[nodiscard]] inline std::string AddressText(std::uint64_t mac) {
  std::array<std::uint8_t, 6> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(mac >> (40U - 8U * i) & 0xFFU);
  return MacText(bytes);
}

}  // namespace ecaudit
