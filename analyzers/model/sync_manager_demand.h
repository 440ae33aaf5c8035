/// What the sync managers of a slave must be set to, from the best source: its own EEPROM, else the description of its
/// family (which an ESI file may have filled).
///
/// in: DeviceDescription, EEPROM contents.  out: one SyncManagerDemand a sync manager, and what differs from it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/device/device_description.h"
#include "decoder/esc/sii.h"
#include "decoder/esc/sync_manager.h"

namespace ecaudit::model {

/// The source of a required setting.
enum class DemandSource : std::uint8_t {
  kNone,
  kStandard,
  kEeprom,
  kEsi,
  kManual,
  kEniPdos,
  kDefaultPdos,
  kAssignedPdos,
};

/// A field that no source states is empty and not evaluated.
struct SyncManagerDemand {
  std::uint8_t number = 0;
  device::SyncManagerUse use = device::SyncManagerUse::kUnused;
  std::vector<std::uint32_t> starts;  ///< ESC addresses, any of them
  std::vector<std::uint32_t> lengths;
  std::optional<std::uint32_t> max_length;
  DemandSource start_source = DemandSource::kNone;
  DemandSource length_source = DemandSource::kNone;
  /// It has to be enabled; false if it may stay off by the EEPROM.
  bool enabled = true;
  /// The EEPROM itself has it switched off: a slave that goes on with it so needs no sync manager there.
  bool off_in_eeprom = false;
  /// Process data through a single buffer, as in the EEPROM of few slaves.
  bool one_buffer = false;
  std::string reference;  ///< "AKD-2011, 4.1"

  [[nodiscard]] bool mailbox() const {
    return use == device::SyncManagerUse::kMailboxOut || use == device::SyncManagerUse::kMailboxIn;
  }
  [[nodiscard]] bool master_writes() const {
    return use == device::SyncManagerUse::kMailboxOut || use == device::SyncManagerUse::kProcessOut;
  }
};

struct SyncManagerDemands {
  /// False: no source states which sync managers the slave has for this purpose.
  bool known = false;
  std::vector<SyncManagerDemand> list;  ///< empty when `known`: the slave has none
};

/// The sync managers of the standard mailboxes. A slave whose EEPROM names no mailbox has none.
[[nodiscard]] SyncManagerDemands MailboxDemands(const device::DeviceDescription& family, const esc::SiiContents& sii);
/// The sync managers of process data. Lengths stay empty: they follow from the assigned PDOs.
[[nodiscard]] SyncManagerDemands ProcessDemands(const device::DeviceDescription& family, const esc::SiiContents& sii);

/// One setting that is not what it must be.
struct SyncManagerFault {
  enum class Field : std::uint8_t { kEnable, kMode, kDirection, kStart, kLength };
  Field field = Field::kEnable;
  DemandSource source = DemandSource::kStandard;
  std::uint32_t observed = 0;
  std::uint32_t expected = 0;         ///< 0 like `observed` for a length that must not be 0
  std::vector<std::uint32_t> others;  ///< further values that are allowed
  bool at_most = false;               ///< `expected` is the largest length
};

/// What of `settings` contradicts `demand`; nothing else of one that is not enabled.
[[nodiscard]] std::vector<SyncManagerFault> FaultsOf(const esc::SyncManager& settings, const SyncManagerDemand& demand);

}  // namespace ecaudit::model
