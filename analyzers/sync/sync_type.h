/// How a slave synchronises by its objects 1C32h and 1C33h. Source: ETG1020, synchronisation.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace ecaudit::sync {

/// Parameters of the outputs and of the inputs.
inline constexpr std::array<std::uint16_t, 2> kSyncObjects{0x1C32, 0x1C33};
inline constexpr std::uint8_t kSyncTypeEntry = 1;

/// Value of subindex 1.
enum class SyncType : std::uint16_t {
  kFreeRun = 0,
  kSmEvent = 1,
  kSync0 = 2,
  kSync1 = 3,
  kSmEventOfInputs = 0x22,
};

[[nodiscard]] constexpr bool IsKnownSyncType(std::uint64_t value) {
  return value <= static_cast<std::uint64_t>(SyncType::kSync1) ||
         value == static_cast<std::uint64_t>(SyncType::kSmEventOfInputs);
}

/// The slave waits for pulses of distributed clocks.
[[nodiscard]] constexpr bool NeedsPulses(SyncType type) {
  return type == SyncType::kSync0 || type == SyncType::kSync1;
}

/// "free run", "SM event", "SYNC0", "SYNC1".
[[nodiscard]] constexpr std::string_view Name(SyncType type) {
  switch (type) {
    case SyncType::kFreeRun:
      return "free run";
    case SyncType::kSmEvent:
    case SyncType::kSmEventOfInputs:
      return "SM event";
    case SyncType::kSync0:
      return "SYNC0";
    case SyncType::kSync1:
      break;
  }
  return "SYNC1";
}

/// @param supported value of subindex 4: free run in bit 0, SM event in bit 1, pulses as a number in bits 2 to 4 (1 is
///        SYNC0, more than that SYNC1 as well)
[[nodiscard]] constexpr bool SupportsSyncType(std::uint64_t supported, SyncType type) {
  const std::uint64_t pulses = supported >> 2U & 7U;
  switch (type) {
    case SyncType::kFreeRun:
      return (supported & 1U) != 0;
    case SyncType::kSmEvent:
    case SyncType::kSmEventOfInputs:
      return (supported & 2U) != 0;
    case SyncType::kSync0:
      return pulses != 0;
    case SyncType::kSync1:
      break;
  }
  return pulses > 1;
}

}  // namespace ecaudit::sync
