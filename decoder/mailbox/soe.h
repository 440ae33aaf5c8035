/// Servo drive profile over EtherCAT.
///
///   | operation:3 incomplete:1 error:1 drive:3 | elements 1 | IDN 2, or fragments left | data |
///
/// Elements: bit 0 data state, 1 name, 2 attribute, 3 unit, 4 minimum, 5 maximum, 6 value. With the error bit the last
/// two bytes are an error code. With the incomplete bit more fragments follow and the IDN field counts them.
/// Source: ETG.1000.6 5.8, IEC 61800-7-300; esc-reference 8.7.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kSoeHeaderBytes = 4;

enum class SoeOperation : std::uint8_t {
  kReadRequest = 1,
  kReadResponse = 2,
  kWriteRequest = 3,
  kWriteResponse = 4,
  kNotification = 5,
  kEmergency = 6,
};

/// "read request"; "operation 7" for a reserved number.
[[nodiscard]] std::string Name(SoeOperation operation);

struct SoeHeader {
  SoeOperation operation = SoeOperation::kReadRequest;
  bool incomplete = false;
  bool error = false;
  std::uint8_t drive = 0;     ///< 0-7
  std::uint8_t elements = 0;  ///< which parts of the IDN are meant, bits as above
  std::uint16_t idn_or_fragments_left = 0;
  ByteSpan data;
  bool too_short = false;  ///< what is missing reads as 0
};

[[nodiscard]] constexpr SoeHeader ParseSoe(ByteSpan payload) {
  const auto first = LittleEndian<std::uint8_t>(payload, 0);
  SoeHeader header;
  header.operation = static_cast<SoeOperation>(first & 0x07U);
  header.incomplete = (first & 0x08U) != 0;
  header.error = (first & 0x10U) != 0;
  header.drive = static_cast<std::uint8_t>(first >> 5U);
  header.elements = LittleEndian<std::uint8_t>(payload, 1);
  header.idn_or_fragments_left = LittleEndian<std::uint16_t>(payload, 2);
  header.data = Slice(payload, kSoeHeaderBytes);
  header.too_short = payload.size() < kSoeHeaderBytes;
  return header;
}

/// "S-0-0017", "P-1-0200".
[[nodiscard]] std::string IdnName(std::uint16_t idn);
/// "name, value" for the set bits of `elements`; "" for none.
[[nodiscard]] std::string ElementNames(std::uint8_t elements);
/// Meaning of an error code of IEC 61800-7-300, "" when it has none.
[[nodiscard]] std::string_view SoeErrorText(std::uint16_t code);

}  // namespace ecaudit::mailbox
