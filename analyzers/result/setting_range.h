/// Some of the settings of a slave: registers, objects or EEPROM words.
#pragma once

#include <cstdint>

#include "analyzers/result/startup_summary.h"

namespace ecaudit {

struct SettingRange {
  enum class Kind : std::uint8_t { kRegister, kObject, kEeprom };
  Kind kind = Kind::kRegister;
  std::uint32_t first = 0;
  std::uint32_t last = 0;  ///< inclusive; 0: none

  friend bool operator==(const SettingRange&, const SettingRange&) = default;

  /// @param bytes  that a step writes to registers
  [[nodiscard]] constexpr bool Holds(const StartupKey& key, std::uint64_t bytes) const {
    switch (key.kind) {
      case StartupKey::Kind::kWrite:
        return kind == Kind::kRegister && key.address <= last && key.address + (bytes == 0 ? 0 : bytes - 1) >= first;
      case StartupKey::Kind::kDownload:
        return kind == Kind::kObject && key.address >= first && key.address <= last;
      case StartupKey::Kind::kEeprom:
        return kind == Kind::kEeprom && key.address >= first && key.address <= last;
      case StartupKey::Kind::kUpload:
      case StartupKey::Kind::kRequest:
      case StartupKey::Kind::kDrive:
        break;
    }
    return false;
  }
};

}  // namespace ecaudit
