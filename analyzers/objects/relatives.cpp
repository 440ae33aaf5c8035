#include "analyzers/objects/relatives.h"

#include "decoder/device/profile_registry.h"

namespace ecaudit::events {

using device::DeviceDescription;
using device::EmergencyCode;

namespace {

/// @param wanted  decides by a profile's name whether it is read
/// @param any  also what is a drive where this is none, and the other way round
template <class Wanted>
std::vector<const DeviceDescription*> RelativesThat(const DeviceDescription& profile, const Wanted& wanted,
                                                    bool any = false) {
  std::vector<const DeviceDescription*> relatives;
  if (!profile.match.vendor_id) return relatives;
  for (const std::string& name : device::BuiltinProfilesOf(*profile.match.vendor_id)) {
    const DeviceDescription* other = name != profile.id && wanted(name) ? device::BuiltinProfile(name) : nullptr;
    if (other == nullptr) continue;
    if (any || other->drive.has_value() == profile.drive.has_value()) relatives.push_back(other);
  }
  return relatives;
}

}  // namespace

std::vector<const DeviceDescription*> Relatives(const DeviceDescription& profile) {
  return RelativesThat(profile, [](const std::string&) { return true; });
}

std::vector<const DeviceDescription*> AllRelatives(const DeviceDescription& profile) {
  return RelativesThat(
      profile, [](const std::string&) { return true; }, true);
}

std::vector<const DeviceDescription*> RelativesWith(const DeviceDescription& profile, std::uint16_t index) {
  return RelativesThat(profile, [&](const std::string& name) { return device::BuiltinProfileLists(name, index); });
}

EmergencyInfo FindEmergency(const DeviceDescription* profile, std::uint16_t code) {
  if (profile == nullptr) return {};
  const auto exact = [code](const EmergencyCode* entry) {
    return entry != nullptr && entry->code == code && entry->last_code == code;
  };
  const EmergencyCode* own = profile->emergency_code(code);
  if (exact(own)) return {own, false};
  // Drives of the maker first, then its other devices: a drive and its supply share most codes.
  for (const bool any : {false, true}) {
    for (const DeviceDescription* other : any ? AllRelatives(*profile) : Relatives(*profile)) {
      const EmergencyCode* entry = other->emergency_code(code);
      if (exact(entry)) return {entry, true, other};
    }
  }
  return {own, false};
}

}  // namespace ecaudit::events
