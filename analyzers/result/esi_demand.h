/// What the ESI of a slave requires of the master, and whether the start-up in the capture meets it: plain data.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/ids.h"

namespace ecaudit {

struct EsiDemand {
  enum class Kind : std::uint8_t { kSyncManager, kInitCommand, kModules, kFmmu, kWatchdog, kActivation, kTimeout };
  enum class Status : std::uint8_t {
    kMet,
    kMissing,  ///< the capture shows the start-up, and nothing that meets it
    kDiffers,  ///< another value than required
    kNotDue,   ///< the master did not request the state before which it is due
    kUnknown,  ///< `seen` is empty: the capture does not show the start-up from INIT on
  };
  Kind kind = Kind::kInitCommand;
  Status status = Status::kUnknown;
  std::uint8_t before = 0;  ///< AL state before whose request it is due
  std::string what;         ///< "download of 6060h:0 Modes of operation", safe to print
  std::string wanted;       ///< "8 (0x08)"; empty: whatever the value
  std::string seen;         ///< what the capture shows instead, or empty
  FrameNo frame = 0;        ///< that shows it; 0: none
  bool by_sdo = false;      ///< an init command of CoE

  [[nodiscard]] bool unmet() const { return status == Status::kMissing || status == Status::kDiffers; }
};

/// "sync-manager", "init-command", ...: public interface.
[[nodiscard]] constexpr std::string_view Name(EsiDemand::Kind kind) {
  constexpr std::array<std::string_view, 7> kNames{"sync-manager", "init-command", "modules", "fmmu",
                                                   "watchdog",     "activation",   "timeout"};
  return kNames[static_cast<std::size_t>(kind)];
}
/// "met", "missing", "differs", "not-due", "unknown": public interface.
[[nodiscard]] constexpr std::string_view Name(EsiDemand::Status status) {
  constexpr std::array<std::string_view, 5> kNames{"met", "missing", "differs", "not-due", "unknown"};
  return kNames[static_cast<std::size_t>(status)];
}

}  // namespace ecaudit
