/// Captures that miss packets: where many returned frames have no outbound copy, or the indices of the frames skip,
/// what was not seen may have happened; and where a drive is enabled before and after a long pause, the pause is the
/// capture's.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/what.h"
#include "decoder/bus/pairing.h"
#include "decoder/track/network.h"

namespace ecaudit {

/// From one missing packet in this number on, what rests on an order of frames is an assumption: with fewer, both
/// copies of one frame are hardly ever missing ...
inline constexpr std::uint64_t kMissesOneIn = 60;
/// ... and in this number on, what rests on a setting or a state as well: with fewer, less than one frame in 100 is
/// missing with both of its copies, and a setting that lasts is seen all the same.
inline constexpr std::uint64_t kMissesManyOneIn = 10;

/// True when it misses at least one packet in `one_in`. A recorder leaves out as many of one direction as of the other:
/// as many of the frames that seem to be lost are counted, too.
[[nodiscard]] inline bool MissesOneIn(std::uint64_t one_in, const bus::PairingStatistics& pairing) {
  const std::uint64_t missed = pairing.missed_outbound + pairing.gaps;
  const std::uint64_t without_return = pairing.lost + pairing.of(bus::Undecided::kRecorder);
  const std::uint64_t seemingly_lost = std::min(without_return, pairing.missed_outbound);
  return missed > 2 && (missed + seemingly_lost) * one_in >= pairing.outbound + pairing.returned;
}

[[nodiscard]] inline bool MissesPackets(const bus::PairingStatistics& pairing) {
  return MissesOneIn(kMissesOneIn, pairing);
}

[[nodiscard]] inline bool MissesMany(const bus::PairingStatistics& pairing) {
  return MissesOneIn(kMissesManyOneIn, pairing);
}

/// True when it misses at least one.
[[nodiscard]] inline bool MissesAny(const bus::PairingStatistics& pairing) {
  return pairing.missed_outbound + pairing.gaps + pairing.likely_skips > 0;
}

/// True when a frame never came back. What it asked for may have been done: it may have been lost on its way back.
[[nodiscard]] inline bool LosesAny(const bus::PairingStatistics& pairing) {
  return pairing.lost > 0;
}

/// Takes what such a capture may only seem to show for what it is: an assumption. It is an info if its rule needs the
/// whole history, or if the capture misses many packets.
void WeakenWhatHistoryMayExplain(FindingStore& store, const std::vector<std::unique_ptr<Rule>>& rules,
                                 const bus::PairingStatistics& pairing);

/// Cycles without process data that no drive's supervision lets pass.
inline constexpr std::uint64_t kHoleCycles = 64;

/// CiA 402: Operation enabled.
[[nodiscard]] inline bool OperationEnabled(const std::optional<std::uint16_t>& status_word) {
  return status_word && (*status_word & 0x6FU) == 0x27U;
}

/// True while a pause is evaluated whose `cycles` passed without process data for a drive that stayed enabled. Shorter
/// ones only where no master sent anything, and the indices of the frames do not show that none are missing.
[[nodiscard]] inline bool IsHole(const sync::OutputWatch& outputs, std::uint64_t cycles) {
  return (cycles >= kHoleCycles || outputs.may_be_hole) && OperationEnabled(outputs.last_status_word) &&
         OperationEnabled(outputs.status_word);
}

}  // namespace ecaudit
