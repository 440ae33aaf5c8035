/// XML for texts of any origin.
#pragma once

#include <string>
#include <string_view>

namespace ecaudit::report {

/// `text` between tags, or in an attribute in double quotes (where a parser reads line breaks as spaces). Markup
/// characters become entities; control characters and broken UTF-8 appear as \xNN as everywhere in reports; the two
/// characters that XML 1.0 forbids beyond these, U+FFFE and U+FFFF, become U+FFFD.
[[nodiscard]] std::string XmlText(std::string_view text);

}  // namespace ecaudit::report
