/// Lines, indentation and colour of the text for a person.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "analyzers/result/finding.h"
#include "cli/report/times.h"

namespace ecaudit::report {

/// Columns of a line where no terminal shows how many it has.
inline constexpr std::size_t kLineWidth = 80;

inline constexpr std::size_t kPageWidth = 110;

/// Columns of a verdict line. On a narrower terminal it has those of the terminal.
inline constexpr std::size_t kVerdictColumns = 100;

/// How text for a person is written.
struct TextStyle {
  bool color = false;  ///< ANSI escape sequences
  std::size_t width = kLineWidth;
  /// At most these for the verdict, which is one line: it is what CI logs and searches show.
  std::size_t verdict_width = kVerdictColumns;
  bool quiet = false;  ///< verdict lines only
  TimeMode time = TimeMode::kRelative;
  std::string folder;  ///< the working directory, for formats whose readers want paths relative to it; may be empty
};

/// Stands for a space at which TextBuilder does not break the line. Printable text never holds it.
inline constexpr char kHardSpace = '\x01';

enum class Style : std::uint8_t { kPlain, kBold, kFaint, kError, kWarning, kInfo, kGood };

[[nodiscard]] constexpr Style StyleOf(Severity severity) {
  return severity == Severity::kError ? Style::kError : severity == Severity::kWarning ? Style::kWarning : Style::kInfo;
}

/// Columns of a terminal that `text` takes (UTF-8): characters of East Asia and pictures take two, combining ones none.
[[nodiscard]] std::size_t Columns(std::string_view text);

/// At most `most` columns of `text`, cut at a space where there is one near the end; what is cut ends in " ...".
[[nodiscard]] std::string CutToColumns(std::string_view text, std::size_t most);

/// Left-justified to `width` columns, at least one space after it; not broken when the line is wrapped.
[[nodiscard]] std::string Padded(std::string_view text, std::size_t width);

/// Untrusted text for one line: as Printable(), with line breaks and tabs as spaces.
[[nodiscard]] std::string OneLine(std::string_view text);

/// Untrusted text of several lines: as Printable(), line breaks kept.
[[nodiscard]] std::string PrintableLines(std::string_view text);

/// "AKD-2011, 4.3.4"; the section may begin with the document's name already. Empty when both are.
[[nodiscard]] std::string ReferenceText(std::string_view document, std::string_view section);

/// Collects lines. Text given to it is trusted: pass untrusted parts through Printable() or OneLine() first.
class TextBuilder {
 public:
  /// For pages of the catalogue: as wide as the text of a rule is.
  explicit TextBuilder(bool color) : color_(color), width_(kPageWidth) {}
  explicit TextBuilder(const TextStyle& style) : color_(style.color), width_(style.width) {}

  /// `text` wrapped in the escape sequence of `style`, or as it is when colours are off.
  [[nodiscard]] std::string Styled(std::string_view text, Style style) const;

  /// One line as it is, indented.
  void Line(std::string_view text = {}, std::size_t indent = 0);
  /// `text` broken at spaces to fit the width; the first line is indented by `indent`, the others by `hanging`.
  /// Words longer than a line stay whole. `text` must hold no escape sequences.
  void Paragraph(std::string_view text, std::size_t indent, std::size_t hanging);
  void Paragraph(std::string_view text, std::size_t indent) { Paragraph(text, indent, indent); }
  /// "label     text", the text wrapped beside the label's column; nothing when `text` is empty.
  void Field(std::string_view label, std::string_view text, std::size_t indent);

  [[nodiscard]] std::size_t width() const { return width_; }
  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  std::string out_;
  bool color_;
  std::size_t width_;
};

}  // namespace ecaudit::report
