/// The operation modes of a device for distributed clocks, as its ESI or its EEPROM (category 60) lists them, and what
/// the master activated. Source: ETG2000, Dc/OpMode; ETG2010, category DC.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/judge/rule_context.h"
#include "analyzers/result/argument.h"
#include "analyzers/sync/dc_unit.h"
#include "decoder/device/esi_description.h"

namespace ecaudit {

struct OperationModes {
  std::vector<device::DcMode> modes;  ///< empty: none are known
  const Word* source = nullptr;       ///< "ESI" or "EEPROM"

  [[nodiscard]] bool from_eeprom() const;
};

/// Those of the ESI (--esi), else those of an EEPROM that the capture shows to the end.
[[nodiscard]] OperationModes OperationModesOf(const RuleContext& context, SlaveId slave);

enum class ModeMatch : std::uint8_t {
  kFits,        ///< cyclic operation, SYNC0, SYNC1 and a fixed cycle are those of one of the modes
  kOtherCycle,  ///< the units are, but not the cycle
  kOther,
};
/// @param modes  not empty
[[nodiscard]] ModeMatch Match(const OperationModes& modes, const sync::SyncSettings& on);
/// {offered}: "0x07 (DC8, 125.00 us)" of each, {more}: how many are not named, and {mode_source}.
void SetOffered(Arguments& arguments, const OperationModes& modes);

}  // namespace ecaudit
