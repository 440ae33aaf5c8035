/// JSON documents as CBOR (RFC 8949), made while the program is built: read many times faster than their text.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ecaudit {

/// What ReadCbor() reads. Empty when `text` is no JSON document, or an object in it has a key twice.
/// @param only  members of the document that are kept; none: all
[[nodiscard]] std::string CborOf(std::string_view text, std::span<const std::string_view> only = {});

}  // namespace ecaudit
