/// A value of an object in the words of the family's manual: bits, the drive's own fault numbers, states, parameters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "decoder/device/device_description.h"

namespace ecaudit::events {

/// What the value shows, for people: "F439 user following error", "bit 15 fault active". Empty where the family's
/// manual describes no meaning of it.
[[nodiscard]] std::string WordsOf(const device::DeviceDescription& family, std::uint16_t index, std::uint8_t subindex,
                                  std::uint64_t raw);

/// The manual describes meanings of values of this object, so that WordsOf() may have words.
[[nodiscard]] bool HasWords(const device::DeviceDescription& family, std::uint16_t index, std::uint8_t subindex);

/// The rows of a fieldbus parameter that a value makes true: one for each bit that the manual describes.
[[nodiscard]] std::vector<const device::FieldbusParameter*> ParameterRows(const device::DeviceDescription& family,
                                                                          std::string_view keyword, std::uint64_t raw);

/// "bit 3", "bits 4-6".
[[nodiscard]] std::string BitsName(unsigned first, unsigned last);

/// "F439 user following error", with the family's own table first, then that of a related family ("by ...").
[[nodiscard]] std::string NumberWords(const device::DeviceDescription& family, const device::FaultObject& object,
                                      std::uint64_t raw);

}  // namespace ecaudit::events
