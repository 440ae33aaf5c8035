/// Captures that miss packets: where many returned frames have no outbound copy, what was not seen may have happened;
/// and where a drive is enabled before and after a long pause, the pause is the capture's.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/sync/sync_model.h"
#include "decoder/bus/pairing.h"

namespace ecaudit {

inline constexpr const char* kMissesPackets =
    "the capture misses packets: many returned frames have no outbound copy, so what it does not show may have "
    "happened";

/// From one returned frame in twenty on. With fewer, both copies of one frame are hardly ever missing.
[[nodiscard]] inline bool MissesPackets(const bus::PairingStatistics& pairing) {
  return pairing.missed_outbound > 2 && pairing.missed_outbound * 20 >= pairing.returned;
}

inline constexpr const char* kHole =
    "the drive is enabled before and after a pause far longer than it tolerates: the capture has a hole there, or the "
    "drive's supervision is switched off";
/// Cycles without process data that no drive's supervision lets pass.
inline constexpr std::uint64_t kHoleCycles = 64;

/// CiA 402: Operation enabled.
[[nodiscard]] inline bool OperationEnabled(const std::optional<std::uint16_t>& status_word) {
  return status_word && (*status_word & 0x6FU) == 0x27U;
}

/// True while a pause is judged whose `cycles` passed without process data for a drive that stayed enabled.
[[nodiscard]] inline bool IsHole(const sync::OutputWatch& outputs, std::uint64_t cycles) {
  return cycles >= kHoleCycles && OperationEnabled(outputs.last_status_word) && OperationEnabled(outputs.status_word);
}

}  // namespace ecaudit
