#include "cli/report/layout.h"

#include <algorithm>

#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kLabelColumns = 11;

std::string_view EscapeSequence(Style style) {
  switch (style) {
    case Style::kPlain:
      return "";
    case Style::kBold:
      return "\x1b[1m";
    case Style::kFaint:
      return "\x1b[2m";
    case Style::kError:
      return "\x1b[1;31m";
    case Style::kWarning:
      return "\x1b[1;33m";
    case Style::kInfo:
      return "\x1b[36m";
    case Style::kGood:
      return "\x1b[1;32m";
  }
  return "";
}

}  // namespace

std::size_t Columns(std::string_view text) {
  // Continuation bytes of UTF-8 take no column of their own.
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string Padded(std::string_view text, std::size_t width) {
  std::string out(text);
  const std::size_t columns = Columns(out);
  out.append(columns < width ? width - columns : 1, ' ');
  std::replace(out.begin(), out.end(), ' ', kHardSpace);
  return out;
}

std::string OneLine(std::string_view text) {
  std::string flat(text);
  std::replace_if(
      flat.begin(), flat.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return Printable(flat);
}

std::string PrintableLines(std::string_view text) {
  std::string out;
  while (true) {
    const std::size_t end = text.find('\n');
    out += Printable(text.substr(0, end));
    if (end == std::string_view::npos) return out;
    out += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string ReferenceText(std::string_view document, std::string_view section) {
  const std::string name = OneLine(document);
  const std::string place = OneLine(section);
  if (name.empty() || place.starts_with(name)) return place;
  return place.empty() ? name : name + ", " + place;
}

std::string TextBuilder::Styled(std::string_view text, Style style) const {
  if (!color_ || style == Style::kPlain) return std::string(text);
  std::string out(EscapeSequence(style));
  out += text;
  out += "\x1b[0m";
  return out;
}

void TextBuilder::Line(std::string_view text, std::size_t indent) {
  if (!text.empty()) {
    out_.append(indent, ' ');
    out_ += text;
  }
  out_ += '\n';
}

void TextBuilder::Paragraph(std::string_view text, std::size_t indent, std::size_t hanging) {
  std::size_t column = 0;
  bool empty_line = true;
  const auto start_line = [&](std::size_t by) {
    out_.append(by, ' ');
    column = by;
    empty_line = true;
  };
  start_line(indent);
  while (!text.empty()) {
    const std::size_t spaces = std::min(text.find_first_not_of(' '), text.size());
    text.remove_prefix(spaces);
    if (text.empty()) break;
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(word.size());
    const std::size_t width = Columns(word);
    if (!empty_line && column + 1 + width > kLineWidth) {
      out_ += '\n';
      start_line(hanging);
    }
    if (!empty_line) {
      out_ += ' ';
      ++column;
    }
    const std::size_t at = out_.size();
    out_ += word;
    std::replace(out_.begin() + static_cast<std::ptrdiff_t>(at), out_.end(), kHardSpace, ' ');
    column += width;
    empty_line = false;
  }
  out_ += '\n';
}

void TextBuilder::Field(std::string_view label, std::string_view text, std::size_t indent) {
  if (text.empty()) return;
  out_.append(indent, ' ');
  out_ += Styled(label, Style::kFaint);
  out_.append(label.size() < kLabelColumns ? kLabelColumns - label.size() : 1, ' ');
  // The label already stands on this line: lay the text out as if indented, and drop that indentation.
  const std::size_t hanging = indent + kLabelColumns;
  const std::size_t at = out_.size();
  Paragraph(text, hanging, hanging);
  out_.erase(at, hanging);
}

std::string Ranges(const std::set<unsigned>& sorted) {
  const std::vector<unsigned> positions(sorted.begin(), sorted.end());
  std::string text;
  for (std::size_t i = 0; i < positions.size();) {
    std::size_t end = i;
    while (end + 1 < positions.size() && positions[end + 1] == positions[end] + 1) ++end;
    if (!text.empty()) text += ", ";
    text += std::to_string(positions[i]);
    if (end > i) text += "-" + std::to_string(positions[end]);
    i = end + 1;
  }
  return text;
}

}  // namespace ecaudit::report
