/// CoE emergency error codes of a family.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ecaudit::device {

enum class EmergencyKind : std::uint8_t { kNone, kFault, kWarning };

struct EmergencyCode {
  std::uint16_t code = 0;
  std::uint16_t last_code = 0;  ///< equals `code`, or the end of a class of codes (0x2000 to 0x20FF: current)
  std::string id;               ///< the drive's own number: "F125", "n125"; empty when it has none
  EmergencyKind kind = EmergencyKind::kFault;
  std::string text;
  std::string note;
  std::string source;
};

struct EmergencyTable {
  /// The first byte of the manufacturer data is the error category, and the rest additional information.
  bool category = false;
  std::vector<EmergencyCode> codes;  ///< sorted by code, classes before their members
  std::string note;
  std::string source;

  /// The row of exactly this code, else that of the narrowest class it belongs to, else null.
  [[nodiscard]] const EmergencyCode* Find(std::uint16_t code) const;
};

}  // namespace ecaudit::device
