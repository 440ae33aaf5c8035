/// Lines, indentation and colour of the text for a person.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include "analyzers/result/finding.h"

namespace ecaudit::report {

inline constexpr std::size_t kLineWidth = 110;

/// Stands for a space at which TextBuilder does not break the line. Printable text never holds it.
inline constexpr char kHardSpace = '\x01';

enum class Style : std::uint8_t { kPlain, kBold, kFaint, kError, kWarning, kInfo, kGood };

[[nodiscard]] constexpr Style StyleOf(Severity severity) {
  return severity == Severity::kError ? Style::kError : severity == Severity::kWarning ? Style::kWarning : Style::kInfo;
}

/// Characters a terminal shows for `text` (UTF-8; each code point counted as one column).
[[nodiscard]] std::size_t Columns(std::string_view text);

/// Left-justified to `width` columns, at least one space behind it; not broken when the line is wrapped.
[[nodiscard]] std::string Padded(std::string_view text, std::size_t width);

/// Untrusted text for one line: as Printable(), with line breaks and tabs as spaces.
[[nodiscard]] std::string OneLine(std::string_view text);

/// Untrusted text of several lines: as Printable(), line breaks kept.
[[nodiscard]] std::string PrintableLines(std::string_view text);

/// "AKD-2011, 4.3.4"; the section may begin with the document's name already. Empty when both are.
[[nodiscard]] std::string ReferenceText(std::string_view document, std::string_view section);

/// "3", "0-2, 7": the numbers of `sorted`, neighbours taken together.
[[nodiscard]] std::string Ranges(const std::set<unsigned>& sorted);

/// Collects lines. Text given to it is trusted: pass untrusted parts through Printable() or OneLine() first.
class TextBuilder {
 public:
  explicit TextBuilder(bool color) : color_(color) {}

  /// `text` wrapped in the escape sequence of `style`, or as it is when colours are off.
  [[nodiscard]] std::string Styled(std::string_view text, Style style) const;

  /// One line as it is, indented.
  void Line(std::string_view text = {}, std::size_t indent = 0);
  /// `text` broken at spaces to fit kLineWidth; the first line is indented by `indent`, the others by `hanging`.
  /// Words longer than a line stay whole. `text` must hold no escape sequences.
  void Paragraph(std::string_view text, std::size_t indent, std::size_t hanging);
  void Paragraph(std::string_view text, std::size_t indent) { Paragraph(text, indent, indent); }
  /// "label     text", the text wrapped beside the label's column; nothing when `text` is empty.
  void Field(std::string_view label, std::string_view text, std::size_t indent);

  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  std::string out_;
  bool color_;
};

}  // namespace ecaudit::report
