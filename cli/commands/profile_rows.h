/// Headings and rows that all parts of a profile's page share.
#pragma once

#include <string>
#include <string_view>

#include "cli/report/layout.h"

namespace ecaudit::cli::profile_page {

inline void Heading(std::string_view heading, std::string_view remark, report::TextBuilder& text) {
  text.Line();
  std::string line = text.Styled(heading, report::Style::kBold);
  if (!remark.empty()) line += " (" + std::string(remark) + ")";
  text.Line(line);
}

/// One row: a name, what is known, and its source.
inline void Row(std::string_view name, std::string about, const std::string& note, const std::string& source,
                report::TextBuilder& text) {
  constexpr std::size_t kNameColumns = 26;
  if (!note.empty()) about += (about.empty() ? "" : "; ") + report::OneLine(note);
  if (!source.empty()) about += " [" + report::OneLine(source) + "]";
  text.Paragraph(report::Padded(name, kNameColumns) + about, 2, 2 + kNameColumns);
}

}  // namespace ecaudit::cli::profile_page
