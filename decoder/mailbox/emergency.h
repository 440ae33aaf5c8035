/// CoE emergency message: what a drive reports unasked when a fault or warning comes or goes.
///
///   | error code 2 | error register 1 (1001h) | manufacturer data 5 |
///
/// Source: ETG.1000.6 5.6.4; error codes in the manuals' chapter 5.1; esc-reference 8.4.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "decoder/base/bytes.h"
#include "decoder/esc/register_map.h"

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

/// What a slave rejects, as the manufacturer data of 0xA000 (PREOP to SAFEOP failed) and 0xA001 (SAFEOP to OP) name it.
///
///   | sync manager:6 aspect:2 | smallest 2 | largest 2 |     (accepted address or length)
///
/// The error register holds the state of the slave, not bits. Source: ETG.1000.6 5.6.4.3.
struct TransitionDiagnosis {
  enum class Aspect : std::uint8_t { kOddAddress, kAddress, kLength, kSettings };
  std::uint8_t sync_manager = 0;
  Aspect aspect = Aspect::kOddAddress;
  std::optional<std::pair<std::uint16_t, std::uint16_t>> accepted;  ///< smallest and largest
};

/// Nothing for data that name no sync manager, or are all 0.
[[nodiscard]] constexpr std::optional<TransitionDiagnosis> ParseTransition(const EmergencyData& emergency) {
  constexpr std::uint8_t kSyncManagers = 16;
  const auto sync_manager = static_cast<std::uint8_t>(emergency.data[0] >> 2U);
  const bool zeros = emergency.data == std::array<std::uint8_t, 5>{};
  if (emergency.too_short || zeros || sync_manager >= kSyncManagers) return std::nullopt;
  TransitionDiagnosis diagnosis;
  diagnosis.sync_manager = sync_manager;
  diagnosis.aspect = static_cast<TransitionDiagnosis::Aspect>(emergency.data[0] & 0x03U);
  const auto low = static_cast<std::uint16_t>(emergency.data[1] | emergency.data[2] << 8U);
  const auto high = static_cast<std::uint16_t>(emergency.data[3] | emergency.data[4] << 8U);
  using Aspect = TransitionDiagnosis::Aspect;
  if (diagnosis.aspect != Aspect::kSettings && low <= high && high != 0) {
    diagnosis.accepted = {low, high};
    // Some makers number the aspects in another way: below the RAM there is no address that a slave could ask for.
    if (diagnosis.aspect != Aspect::kLength && high < esc::kProcessRam) diagnosis.aspect = Aspect::kLength;
  }
  return diagnosis;
}

}  // namespace ecaudit::mailbox
