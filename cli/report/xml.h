/// XML for texts of any origin.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace ecaudit::report {

/// `text` between tags, or in an attribute in double quotes (where a parser reads line breaks as spaces). Markup
/// characters become entities; control characters appear as \xNN as everywhere in reports (Printable()); the two
/// characters that XML 1.0 forbids beyond these, U+FFFE and U+FFFF, become U+FFFD.
[[nodiscard]] std::string XmlText(std::string_view text);

/// A document, element by element, indented by two spaces. Texts may be of any origin, as for XmlText().
class XmlWriter {
 public:
  XmlWriter();
  XmlWriter(const XmlWriter&) = delete;
  XmlWriter& operator=(const XmlWriter&) = delete;
  ~XmlWriter();

  /// Opens an element.
  XmlWriter& Begin(std::string_view name);
  /// Of the element opened last, which has no content yet. Line breaks become spaces.
  XmlWriter& Attribute(std::string_view name, std::string_view value);
  XmlWriter& Attribute(std::string_view name, std::uint64_t value);
  /// The content of the element opened last.
  XmlWriter& Text(std::string_view text);
  /// Closes the element opened last.
  XmlWriter& End();
  /// Closes what is open. Nothing may be written afterwards.
  [[nodiscard]] std::string Take();

 private:
  struct Stream;
  std::unique_ptr<Stream> stream_;
};

}  // namespace ecaudit::report
