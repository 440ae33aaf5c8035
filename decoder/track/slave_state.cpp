#include "decoder/track/slave_state.h"

namespace ecaudit::track {

std::optional<esc::SyncManager> SlaveState::sync_manager(std::size_t n, Certainty at_least) const {
  // Status and PDI control belong to the slave; unknown ones read as 0 and do not matter here.
  const EscAddress at = esc::SyncManagerAddress(n);
  if (registers.CertaintyOf(static_cast<EscAddress>(at + 6), 1) < at_least || registers.CertaintyOf(at, 5) < at_least) {
    return std::nullopt;
  }
  std::array<std::uint8_t, esc::kSyncManagerBytes> bytes{};
  registers.Read(at, bytes);
  return esc::SyncManager::Decode(bytes);
}

std::optional<esc::Fmmu> SlaveState::fmmu(std::size_t n, Certainty at_least) const {
  const EscAddress at = esc::FmmuAddress(n);
  // The last byte first: most units of most slaves were never touched, and all are asked for after each change of one.
  if (registers.CertaintyOf(static_cast<EscAddress>(at + 12), 1) < at_least) return std::nullopt;
  if (registers.CertaintyOf(at, 13) < at_least) return std::nullopt;
  std::array<std::uint8_t, esc::kFmmuBytes> bytes{};
  registers.Read(at, bytes);
  return esc::Fmmu::Decode(bytes);
}

std::size_t SlaveState::fmmu_count() const {
  const auto count = registers.Value<std::uint8_t>(kFmmuCount);
  return count && *count <= esc::kMaxFmmus ? *count : esc::kMaxFmmus;
}

bool SlaveState::IsOff(std::size_t n) const {
  const auto activate = registers.Value<std::uint8_t>(static_cast<EscAddress>(esc::FmmuAddress(n) + 12));
  return activate && (*activate & 1U) == 0;
}

bool SlaveState::MayMapUnseen(std::size_t n) const {
  if (n >= fmmu_count() || IsOff(n) || fmmu(n, Certainty::kInferred)) return false;
  // A master that sets a slave up enables what it uses, and has disabled the rest.
  return set_up_since == 0 || fmmu_since[n] > set_up_since;
}

std::optional<esc::SyncManager> SlaveState::process_manager(esc::SmDirection direction) const {
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    const auto manager = sync_manager(n, Certainty::kInferred);
    if (manager && manager->enabled() && esc::IsProcessData(n, *manager) && manager->direction() == direction &&
        manager->length > 0) {
      return manager;
    }
  }
  return std::nullopt;
}

}  // namespace ecaudit::track
