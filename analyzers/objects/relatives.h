/// What the manuals of sister families state where a family's own manual is silent. Always an inference: families
/// differ.
#pragma once

#include <cstdint>
#include <vector>

#include "decoder/device/device_description.h"

namespace ecaudit::events {

/// Families of the same maker (by vendor ID) that are the same kind of device: drives for a drive.
[[nodiscard]] std::vector<const device::DeviceDescription*> Relatives(const device::DeviceDescription& profile);

/// All families of the same maker, of any kind: a drive and the supply that it hangs on.
[[nodiscard]] std::vector<const device::DeviceDescription*> AllRelatives(const device::DeviceDescription& profile);

/// Those of Relatives() whose manuals list this object themselves: for all others only the standard describes it.
[[nodiscard]] std::vector<const device::DeviceDescription*> RelativesWith(const device::DeviceDescription& profile,
                                                                          std::uint16_t index);

struct EmergencyInfo {
  const device::EmergencyCode* code = nullptr;      ///< null: unknown
  bool inferred = false;                            ///< from a sister family
  const device::DeviceDescription* from = nullptr;  ///< that family
};
/// The family's own entry for a CoE emergency code; where it only knows the class of the code, a sister family's entry
/// for exactly this code, if there is one. `profile` may be null.
[[nodiscard]] EmergencyInfo FindEmergency(const device::DeviceDescription* profile, std::uint16_t code);

}  // namespace ecaudit::events
