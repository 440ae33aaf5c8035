/// Text that is much the same again and again, made small for a page that is mailed.
#pragma once

#include <string>
#include <string_view>

namespace ecaudit::report {

/// `text` deflated (zlib, RFC 1950) in Base64: what browsers unpack as "deflate". Empty where it cannot be made.
[[nodiscard]] std::string Packed(std::string_view text);

}  // namespace ecaudit::report
