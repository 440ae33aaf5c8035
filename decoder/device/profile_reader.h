/// Reads a drive family from its JSON profile.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>

#include "decoder/base/json.h"
#include "decoder/base/result.h"
#include "decoder/device/device_description.h"

namespace ecaudit::device {

/// Gives the profile that another one extends; null when there is none of that name.
using ProfileLookup = std::function<const DeviceDescription*(std::string_view id)>;

/// Reads a profile; `lookup` resolves "extends".
///
/// Sections that the profile does not have come from the extended profile; tables it has replace the extended ones,
/// except that of the registers, where a row replaces the extended rows that it touches.
/// Fails on the first thing that is not as it should be, with its place: "al.transitions[3].from: \"X\" is none of
/// INIT, PREOP, BOOT, SAFEOP, OP".
[[nodiscard]] Result<DeviceDescription> ReadProfile(std::string_view json, const ProfileLookup& lookup);
/// Same, from a document that was read before.
[[nodiscard]] Result<DeviceDescription> ReadProfile(const JsonDocument& document, const ProfileLookup& lookup);
/// Same, extending built-in profiles.
[[nodiscard]] Result<DeviceDescription> ReadProfile(std::string_view json);

/// What a profile states about itself, without the rest: to order the profiles of a folder, and to choose one.
struct ProfileHead {
  std::string id;
  std::string extends;
  std::string edition;
  IdentityMatch match;
};
/// Reads no further than "match", which stands at the beginning of a profile; the rest may be damaged.
[[nodiscard]] Result<ProfileHead> ReadProfileHead(std::string_view json);
/// Same, from a document that has kHeadKeys at least.
[[nodiscard]] Result<ProfileHead> ReadProfileHead(const JsonDocument& document);
inline constexpr std::array<std::string_view, 5> kHeadKeys = {"schema", "id", "extends", "edition", "match"};

}  // namespace ecaudit::device
