/// A message of the diagnosis history of a slave: object 10F3h, subindex 6 and following.
///
///   | diag code 4 | flags 2 | text ID 2 | time stamp 8 (ns) | for each parameter: flags 2, value |
///
/// Source: ETG.1020, diagnosis handling (object 10F3h), as the manuals of slaves print it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/mailbox/emergency.h"

namespace ecaudit::mailbox {

inline constexpr std::uint16_t kDiagnosisHistory = 0x10F3;
inline constexpr std::uint8_t kFirstDiagnosisMessage = 6;  ///< first subindex with a message
inline constexpr std::size_t kDiagnosisHeaderBytes = 16;

enum class DiagnosisType : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };

struct DiagnosisMessage {
  std::uint32_t code = 0;
  std::uint16_t flags = 0;
  std::uint16_t text_id = 0;                              ///< of a text in the ESI; 0: none
  std::uint64_t time_ns = 0;                              ///< 0: none
  std::vector<std::string> parameters;                    ///< as text, safe to print
  std::vector<std::uint16_t> parameter_texts;             ///< of each parameter: the text ID that it is; 0: it is none
  std::optional<std::array<std::uint8_t, 5>> five_bytes;  ///< the first parameter of 5 bytes without a type
  bool too_short = false;                                 ///< the header is not complete: nothing else is known
  bool cut = false;  ///< the parameters are not complete, or have a layout that is not known

  /// Values from 3 on are reserved.
  [[nodiscard]] std::uint8_t type() const { return static_cast<std::uint8_t>(flags & 0x0FU); }
  [[nodiscard]] bool local_time() const { return (flags & 0x10U) != 0; }
  /// The error code of the emergency for the same event, which the diag code has in its upper half.
  [[nodiscard]] std::optional<std::uint16_t> emergency_code() const;
  /// That emergency, if the message has its manufacturer data as a parameter. The error register is not known: 0.
  [[nodiscard]] std::optional<EmergencyData> emergency() const;
  /// An entry that was never filled.
  [[nodiscard]] bool empty() const { return code == 0 && flags == 0 && text_id == 0 && time_ns == 0; }
};

/// The object holds a message.
[[nodiscard]] constexpr bool IsDiagnosisMessage(std::uint16_t index, std::uint8_t subindex) {
  return index == kDiagnosisHistory && subindex >= kFirstDiagnosisMessage;
}
[[nodiscard]] DiagnosisMessage ParseDiagnosisMessage(ByteSpan bytes);

/// Texts of an ESI by text ID. A text has places for parameters as printf() has them (%d, %x, %s). Untrusted.
using DiagnosisTexts = std::map<std::uint16_t, std::string>;

/// "error, diag code 0x4210e800 (emergency 0x4210), text ID 0x3702, parameters: 2, 128, local time 13.2 s"; with the
/// text "error: Short circuit in module 2, channel 128 (text ID 0x3702), diag code 0x4210e800 ...". Safe to print.
/// @param texts  null: none
[[nodiscard]] std::string DiagnosisText(const DiagnosisMessage& message, const DiagnosisTexts* texts = nullptr);

}  // namespace ecaudit::mailbox
