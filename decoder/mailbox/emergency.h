/// CoE emergency message: what a drive reports unasked when a fault or warning comes or goes.
///
///   | error code 2 | error register 1 (1001h) | manufacturer data 5 |
///
/// Source: ETG.1000.6 5.6.4; error codes in the manuals' chapter 5.1; esc-reference 8.4.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kEmergencyBytes = 8;

struct EmergencyData {
  std::uint16_t error_code = 0;  ///< 0x0000: error free again
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> data{};
  bool too_short = false;  ///< what is missing reads as 0
};

/// @param bytes  after the CoE header
[[nodiscard]] constexpr EmergencyData ParseEmergency(ByteSpan bytes) {
  EmergencyData emergency;
  emergency.error_code = LittleEndian<std::uint16_t>(bytes, 0);
  emergency.error_register = LittleEndian<std::uint8_t>(bytes, 2);
  for (std::size_t i = 0; i < emergency.data.size(); ++i) emergency.data[i] = LittleEndian<std::uint8_t>(bytes, 3 + i);
  emergency.too_short = bytes.size() < kEmergencyBytes;
  return emergency;
}

/// The number of a fault or warning as ASCII text, "F125" or "125", that a drive may put after the first byte of the
/// manufacturer data; empty where these bytes are no such text.
[[nodiscard]] inline std::string NumberText(const EmergencyData& emergency) {
  std::string text;
  for (std::size_t i = 1; i < emergency.data.size() && emergency.data[i] != 0; ++i) {
    const auto c = static_cast<char>(emergency.data[i]);
    const bool letter = text.empty() && (c == 'F' || c == 'f' || c == 'n' || c == 'N');
    if (!letter && (c < '0' || c > '9')) return {};
    text += c;
  }
  return text.size() < 2 ? std::string() : text;
}

}  // namespace ecaudit::mailbox
