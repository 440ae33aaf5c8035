/// AL (application layer) states and the bit fields of AL Control 0x0120 and AL Status 0x0130 (esc-reference 5).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ecaudit::esc {

enum class AlState : std::uint8_t {
  INIT = 1,    ///< no mailbox, no process data
  PREOP = 2,   ///< mailbox
  BOOT = 3,    ///< firmware download through FoE only
  SAFEOP = 4,  ///< mailbox and inputs, outputs safe
  OP = 8,      ///< everything
};

[[nodiscard]] constexpr bool IsAlState(std::uint8_t value) {
  return value == 1 || value == 2 || value == 3 || value == 4 || value == 8;
}
/// AL status codes (0x0134) that decide something; AlStatusCodeName() has the names of all.
namespace al_code {
enum Code : std::uint16_t {
  kUnspecified = 0x0001,
  kInvalidChange = 0x0011,
  kUnknownState = 0x0012,
  kBootNotSupported = 0x0013,
  kBootMailbox = 0x0015,
  kMailbox = 0x0016,
  kSyncManagers = 0x0017,
  kNoInputs = 0x0018,
  kNoOutputs = 0x0019,
  kSynchronization = 0x001A,
  kWatchdog = 0x001B,
  kOutputs = 0x001D,
  kInputs = 0x001E,
  kWatchdogSettings = 0x001F,
  kNeedsInit = 0x0021,
  kInputMapping = 0x0024,
  kOutputMapping = 0x0025,
  kInconsistent = 0x0026,
  kFreeRun = 0x0027,
  kSyncMode = 0x0028,
  kFreeRunBuffers = 0x0029,
  kNoInputsAndOutputs = 0x002B,
  kFatalSync = 0x002C,
  kNoSync = 0x002D,
  kCycleTooSmall = 0x002E,
  kSyncSettings = 0x0030,
  kLatchSettings = 0x0031,
  kPll = 0x0032,
  kSyncIo = 0x0033,
  kSyncTimeout = 0x0034,
  kSyncCycle = 0x0035,
  kSync0Cycle = 0x0036,
  kSync1Cycle = 0x0037,
  kEepromAccess = 0x0050,
  kModules = 0x0070,
  kFirstOfVendors = 0x8000,
};
}  // namespace al_code

/// AL status codes of a slave in operation whose SYNC signals or their relation to the process data went wrong
/// (esc-reference 5.5): 0x001A, 0x002C to 0x0036.
[[nodiscard]] constexpr bool SpeaksOfSynchronisation(std::int64_t al_status_code) {
  return al_status_code == al_code::kSynchronization ||
         (al_status_code >= al_code::kFatalSync && al_status_code <= al_code::kSync0Cycle);
}
/// "INIT", "PREOP", ...; for other values "state 5".
[[nodiscard]] std::string StateName(std::uint8_t value);
/// "PREOP" for a defined state.
[[nodiscard]] std::string_view StateName(AlState state);
/// Reads what StateName() writes; 0 for any other text.
[[nodiscard]] std::uint8_t StateFromName(std::string_view name);

/// AL Control or AL Status.
struct AlWord {
  std::uint16_t raw = 0;
  [[nodiscard]] std::uint8_t state() const { return raw & 0x0FU; }
  /// AL Control: acknowledge. AL Status: error indication.
  [[nodiscard]] bool bit4() const { return (raw & 0x10U) != 0; }
  /// AL Control: identification requested. AL Status: identification is in 0x0134.
  [[nodiscard]] bool identification() const { return (raw & 0x20U) != 0; }
  /// Bits 6 to 15: reserved, or of the application of the slave.
  [[nodiscard]] std::uint16_t other_bits() const { return raw & 0xFFC0U; }
};

/// Name of a standard AL status code (ETG.1000.6 table 11, ETG.1020), "" when it has none.
[[nodiscard]] std::string_view AlStatusCodeName(std::uint16_t code);

/// "PREOP", "SAFEOP+ERR" as AL Status is usually written.
[[nodiscard]] std::string StatusText(std::uint16_t al_status);
/// OredStatesText() with the error bit: "SAFEOP and OP, and the error bit" of an OR of AL Status of all slaves.
[[nodiscard]] std::string StatesOfAllText(std::uint16_t status);
/// What several slaves together may be in when a broadcast ORed their states: 14 is "PREOP, SAFEOP and OP", 3 "BOOT, or
/// INIT and PREOP".
[[nodiscard]] std::string OredStatesText(std::uint8_t states);

}  // namespace ecaudit::esc
