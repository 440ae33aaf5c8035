#include "cli/report/xml.h"

#include "cli/report/layout.h"

namespace ecaudit::report {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// U+FFFE or U+FFFF.
bool BeginsWithNoCharacter(std::string_view text) {
  return text.starts_with("\xEF\xBF\xBE") || text.starts_with("\xEF\xBF\xBF");
}

}  // namespace

std::string XmlText(std::string_view text) {
  const std::string printable = PrintableLines(text);
  std::string out;
  out.reserve(printable.size());
  for (std::size_t i = 0; i < printable.size(); ++i) {
    switch (const char c = printable[i]) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        if (BeginsWithNoCharacter(std::string_view(printable).substr(i))) {
          out += kReplacement;
          i += kReplacement.size() - 1;
        } else {
          out += c;
        }
    }
  }
  return out;
}

}  // namespace ecaudit::report
