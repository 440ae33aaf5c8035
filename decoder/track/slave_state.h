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
/// How many FMMUs there are.
inline constexpr EscAddress kFmmuCount = 0x0004;

/// What a slave's FMMUs and sync managers do, as far as known.
struct KnownFmmus {
  struct Unit {
    std::uint8_t number = 0;
    esc::Fmmu fmmu;
  };
  bool any = false;          ///< some FMMU is known, and be it that it maps nothing
  bool all = false;          ///< ... or it has none, and none is left that may map something unseen
  std::vector<Unit> active;  ///< by number
  /// SlaveState::sync_manager() of each, inferred at least.
  std::array<std::optional<esc::SyncManager>, esc::kMaxSyncManagers> managers;
};

struct SlaveState {
  esc::RegisterImage registers;
  Known<esc::AlWord> al_status;         ///< as last read
  Known<std::uint16_t> al_status_code;  ///< as last read
  SiiAssembler sii;                     ///< EEPROM as far as the master read it
  /// What of this is presumed: nothing was seen of the slave since a capture gap.
  enum class Presumed : std::uint8_t {
    kNothing,
    kMapping,  ///< all but the AL state, which was SAFEOP
    kAll,      ///< it was in OP
  };
  Presumed presumed = Presumed::kNothing;
  /// It was gone for a while, and nothing shows yet whether it was without power: then its registers hold nothing.
  bool returned = false;
  /// The frame that asked it for INIT, or gave it its station address: the capture shows how it is set up from there
  /// on. 0: none did.
  FrameNo set_up_since = 0;
  /// Frame of the last write or read that reported something about sync manager / FMMU n.
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
  /// FMMUs that the ESC has: register 0x0004 where it was read, else as many as there may be.
  [[nodiscard]] std::size_t fmmu_count() const;
  /// FMMU n is switched off, whatever else it holds.
  [[nodiscard]] bool IsOff(std::size_t n) const;
  /// FMMU n may map something that the capture does not show. Which of them a master uses, and in which order it sets
  /// them, is its own affair: that another one is known shows nothing of this one.
  [[nodiscard]] bool MayMapUnseen(std::size_t n) const;
};

}  // namespace ecaudit::track
