/// Meaning of single bits of objects, as the family's manual describes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace ecaudit::device {

/// What a bit shows when it is 1, for objects by which a device without a status word reports trouble.
enum class BitSign : std::uint8_t { kNone, kFault, kWarning, kEither };

/// One bit field of an object, or one value of it.
struct ObjectBits {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t first = 0;
  std::uint8_t last = 0;
  std::optional<std::uint32_t> value;  ///< of the field, when this row describes one value only
  std::string name;
  std::string meaning;
  bool reserved = false;  ///< must be, or is, 0
  BitSign sign = BitSign::kNone;
  std::string note;
  std::string source;

  /// The field in a value of the object.
  [[nodiscard]] std::uint32_t Of(std::uint64_t raw) const {
    const std::uint64_t mask = (std::uint64_t{1} << (last - first + 1U)) - 1;
    return static_cast<std::uint32_t>(raw >> first & mask);
  }
};

}  // namespace ecaudit::device
