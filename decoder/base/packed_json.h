/// JSON documents packed when the program is built: read many times faster than their text. Only for what belongs to
/// the program; all other documents are text.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "decoder/base/json.h"

namespace ecaudit {

/// Empty when `text` is no JSON document, or an object in it has a key twice.
/// @param only  members of the document that are packed; none: all
[[nodiscard]] std::string PackJson(std::string_view text, std::span<const std::string_view> only = {});

/// The document of which PackJson() made `packed`, which must outlive it; nothing when it made no such thing.
[[nodiscard]] std::optional<JsonDocument> UnpackJson(std::string_view packed);

}  // namespace ecaudit
