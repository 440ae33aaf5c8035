/// Meaning of single bits of registers, as the family's manual describes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "decoder/base/ids.h"
#include "decoder/device/register_right.h"

namespace ecaudit::device {

/// One bit field, or one value of it.
struct RegisterBits {
  EscAddress address = 0;  ///< of the byte, or of the 16-bit word when `last` is above 7
  std::uint8_t first = 0;
  std::uint8_t last = 0;
  std::optional<std::uint16_t> value;  ///< of the field, when this row describes one value only
  std::optional<bool> rising;          ///< it acts by this edge, not by its level
  std::string name;
  std::string meaning;
  Access ecat = Access::kUnknown;
  Access drive = Access::kUnknown;
  std::optional<EscAddress> printed_address;  ///< where print is wrong
  std::string note;
  std::string source;

  [[nodiscard]] bool Covers(std::uint8_t bit) const { return bit >= first && bit <= last; }
};

}  // namespace ecaudit::device
