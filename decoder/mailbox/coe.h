/// CANopen over EtherCAT: the two bytes in front of every CoE service.
///
///   | number:9 reserved:3 service:4 | SDO, SDO information, emergency or PDO |
///
/// Source: ETG.1000.6 5.6.1; AKD manual 4.12, MKD 4.13, Pilz 4.10; esc-reference 8.4.
#pragma once

#include <cstdint>
#include <string>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kCoeHeaderBytes = 2;

enum class CoeService : std::uint8_t {
  kEmergency = 1,
  kSdoRequest = 2,
  kSdoResponse = 3,
  kTxPdo = 4,         ///< slave to master
  kRxPdo = 5,         ///< master to slave
  kTxPdoRequest = 6,  ///< remote transmission request
  kRxPdoRequest = 7,  ///< remote transmission request
  kSdoInformation = 8,
};

[[nodiscard]] constexpr bool IsDefined(CoeService service) {
  return static_cast<std::uint8_t>(service) >= 1 && static_cast<std::uint8_t>(service) <= 8;
}
/// "SDO request"; "service 9" for a reserved number.
[[nodiscard]] std::string Name(CoeService service);

struct CoeHeader {
  std::uint16_t number = 0;   ///< PDO number, 0-511; 0 for SDO
  std::uint8_t reserved = 0;  ///< three bits, must be 0
  CoeService service = CoeService::kSdoRequest;
};

/// Fields of the first two bytes of a CoE payload; what is missing reads as 0.
[[nodiscard]] constexpr CoeHeader ParseCoeHeader(ByteSpan payload) {
  const auto word = LittleEndian<std::uint16_t>(payload, 0);
  CoeHeader header;
  header.number = word & 0x01FFU;
  header.reserved = static_cast<std::uint8_t>(word >> 9U & 0x07U);
  header.service = static_cast<CoeService>(word >> 12U);
  return header;
}

}  // namespace ecaudit::mailbox
