/// The bytes of an SDO transfer as a value: number, text, or one value for each subindex.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "analyzers/objects/object_names.h"
#include "decoder/base/bytes.h"

namespace ecaudit::events {

struct ObjectValue {
  /// Integers and reals as such. Text is a string of the object (untrusted), a PDO mapping entry ("6040h:0 16 bit
  /// Control word"), or bytes whose type is unknown as FormatValue() writes them.
  std::variant<std::monostate, std::uint64_t, std::int64_t, double, bool, std::string> value;
  std::vector<ObjectValue> items;  ///< complete access: one for each subindex
  std::uint8_t subindex = 0;       ///< of an item
  /// For people, safe to print: "106 (0x6a)", "1701h", "6040h:0 16 bit Control word"; "" for no bytes.
  std::string text;

  [[nodiscard]] bool empty() const { return items.empty() && std::holds_alternative<std::monostate>(value); }
};

/// The value of one subindex.
/// @param bytes as transferred; where their number does not fit the type, they are shown as they are
[[nodiscard]] ObjectValue ReadValue(const ObjectNames& names, const device::DeviceDescription* profile,
                                    std::uint16_t index, std::uint8_t subindex, ByteSpan bytes);
/// The values of a complete access: subindex 0 as 16 bits (count and padding) when it starts there, then the others
/// packed (ETG.1000.6 5.6.2). Where a type is unknown, the rest is one item.
[[nodiscard]] ObjectValue ReadCompleteAccess(const ObjectNames& names, const device::DeviceDescription* profile,
                                             std::uint16_t index, std::uint8_t first_subindex, ByteSpan bytes);

/// "6040h:0 16 bit Control word", "gap of 8 bits": a PDO mapping entry.
[[nodiscard]] std::string MappingText(const ObjectNames& names, const device::DeviceDescription* profile,
                                      std::uint32_t entry);

}  // namespace ecaudit::events
