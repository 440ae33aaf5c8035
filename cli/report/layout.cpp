#include "cli/report/layout.h"

#include <algorithm>
#include <array>

#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kLabelColumns = 11;

std::string_view EscapeSequence(Style style) {
  static constexpr Named<Style> kNames[] = {
      {Style::kPlain, ""},           {Style::kBold, "\x1b[1m"},       {Style::kFaint, "\x1b[2m"},
      {Style::kError, "\x1b[1;31m"}, {Style::kWarning, "\x1b[1;33m"}, {Style::kInfo, "\x1b[36m"},
      {Style::kGood, "\x1b[1;32m"},
  };
  static_assert(NamesAll(kNames, Style::kGood));
  return NameIn(kNames, style);
}

/// Takes one character from the front of `text`; a byte that is no UTF-8 counts as one.
char32_t TakeCodePoint(std::string_view& text) {
  const auto lead = static_cast<unsigned char>(text.front());
  const std::size_t length = lead < 0x80 ? 1 : lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
  char32_t point = length == 1 ? lead : lead & (0xFFU >> (length + 1));
  std::size_t taken = 1;
  for (; taken < length && taken < text.size(); ++taken) {
    const auto next = static_cast<unsigned char>(text[taken]);
    if ((next & 0xC0U) != 0x80U) break;
    point = point << 6U | (next & 0x3FU);
  }
  text.remove_prefix(taken);
  return point;
}

struct CodeRange {
  char32_t first, last;
};
// Of Unicode's EastAsianWidth and combining classes, what names and texts of devices may hold.
constexpr std::array<CodeRange, 9> kTwoColumns{{{0x1100, 0x115F},
                                                {0x2E80, 0x303E},
                                                {0x3041, 0xA4CF},
                                                {0xAC00, 0xD7A3},
                                                {0xF900, 0xFAFF},
                                                {0xFE30, 0xFE6F},
                                                {0xFF00, 0xFF60},
                                                {0x1F300, 0x1FAFF},
                                                {0x20000, 0x3FFFD}}};
constexpr std::array<CodeRange, 6> kNoColumn{
    {{0x0300, 0x036F}, {0x0483, 0x0489}, {0x200B, 0x200F}, {0x20D0, 0x20FF}, {0xFE00, 0xFE0F}, {0xFE20, 0xFE2F}}};

std::size_t ColumnsOf(char32_t point) {
  const auto holds = [point](const CodeRange& range) { return range.first <= point && point <= range.last; };
  if (point < 0x0300) return 1;
  if (std::ranges::any_of(kNoColumn, holds)) return 0;
  return std::ranges::any_of(kTwoColumns, holds) ? 2 : 1;
}

}  // namespace

std::size_t Columns(std::string_view text) {
  std::size_t columns = 0;
  while (columns < text.size() && text[columns] >= 0x20 && text[columns] <= 0x7E) ++columns;
  text.remove_prefix(columns);
  while (!text.empty()) columns += ColumnsOf(TakeCodePoint(text));
  return columns;
}

std::string CutToColumns(std::string_view text, std::size_t most) {
  if (Columns(text) <= most) return std::string(text);
  constexpr std::string_view kEnd = " ...";
  constexpr std::size_t kLongestTail = 16;
  const std::size_t room = most > kEnd.size() ? most - kEnd.size() : 0;
  std::size_t columns = 0;
  std::string_view rest = text;
  std::size_t end = 0;
  while (!rest.empty()) {
    columns += ColumnsOf(TakeCodePoint(rest));
    if (columns > room) break;
    end = text.size() - rest.size();
  }
  const std::size_t space = text.substr(0, end + 1).rfind(' ');
  if (space != std::string_view::npos && space > 0 && end - std::min(space, end) <= kLongestTail) end = space;
  std::string out(text.substr(0, end));
  while (!out.empty() && (out.back() == ' ' || out.back() == ',' || out.back() == ';' || out.back() == ':')) {
    out.pop_back();
  }
  return out + std::string(kEnd);
}

std::string Padded(std::string_view text, std::size_t width) {
  std::string out(text);
  const std::size_t columns = Columns(out);
  out.append(columns < width ? width - columns : 1, ' ');
  std::ranges::replace(out, ' ', kHardSpace);
  return out;
}

std::string OneLine(std::string_view text) {
  std::string flat(text);
  std::ranges::replace_if(
      flat, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
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
    if (!empty_line && column + 1 + width > width_) {
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

}  // namespace ecaudit::report
