/// What is known of one slave's ESC, from the accesses it took part in.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/known.h"
#include "decoder/esc/al.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/register_image.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/track/sii_tracker.h"

namespace ecaudit::track {

/// Where the registers of the FMMUs and sync managers are.
inline constexpr EscAddress kMappingFirst = 0x0600;
inline constexpr EscAddress kMappingEnd = 0x0880;

/// What a slave's FMMUs and sync managers do, as far as known.
struct KnownFmmus {
  struct Unit {
    std::uint8_t number = 0;
    esc::Fmmu fmmu;
  };
  bool any = false;          ///< some FMMU is known, and be it that it maps nothing
  std::vector<Unit> active;  ///< by number
  /// SlaveState::sync_manager() of each, inferred at least.
  std::array<std::optional<esc::SyncManager>, esc::kMaxSyncManagers> managers;
};

struct SlaveState {
  esc::RegisterImage registers;
  Known<esc::AlWord> al_status;         ///< as last read
  Known<std::uint16_t> al_status_code;  ///< as last read
  SiiAssembler sii;                     ///< EEPROM as far as the master read it
  /// It was in OP before a hole in the capture, and nothing was seen of it since: all of this is presumed.
  bool presumed = false;
  /// It was gone for a while, and nothing shows yet whether it was without power: then its registers hold nothing.
  bool returned = false;
  /// Frame of the last write or read that told something about sync manager / FMMU n.
  std::array<FrameNo, esc::kMaxSyncManagers> sync_manager_since{};
  std::array<FrameNo, esc::kMaxFmmus> fmmu_since{};
  /// Changes whenever a register from 0x0600 to 0x08FF may have changed, so that what is derived can be cached.
  std::uint32_t mapping_version = 0;

  /// Settings of sync manager n, if every byte that the master configures is known.
  [[nodiscard]] std::optional<esc::SyncManager> sync_manager(std::size_t n, Certainty at_least) const;
  /// The first enabled one for process data in this direction, whatever its number: terminals without mailbox begin
  /// with it. Only those known, inferred at least, are looked at.
  [[nodiscard]] std::optional<esc::SyncManager> process_manager(esc::SmDirection direction) const;
  /// Settings of FMMU n, likewise.
  [[nodiscard]] std::optional<esc::Fmmu> fmmu(std::size_t n, Certainty at_least) const;
};

}  // namespace ecaudit::track
