/// The files that are compiled into the program (Qt resources).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ecaudit::device {

/// Names of the embedded profiles without ".json", alphabetical.
[[nodiscard]] std::vector<std::string> EmbeddedProfileNames();
/// The text of one, where it lies in the program; empty when there is none of that name.
[[nodiscard]] std::string_view EmbeddedProfileText(std::string_view name);
/// The same as CborOf() made it when the program was built; empty when there is none of that name.
[[nodiscard]] std::string_view EmbeddedProfileCbor(std::string_view name);
/// Likewise of nothing but its head.
[[nodiscard]] std::string_view EmbeddedHeadCbor(std::string_view name);
/// Indices of the objects that it has rows of, without those of the profile that it extends: ascending, 16 bit each,
/// low byte first.
[[nodiscard]] std::string_view EmbeddedObjects(std::string_view name);

}  // namespace ecaudit::device
