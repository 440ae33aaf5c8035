/// The documents that profiles and rules cite by a short key; docs/sources.md describes them for people.
#pragma once

#include <span>
#include <string_view>

namespace ecaudit::device {

struct SourceDocument {
  std::string_view key;    ///< "AKD-2010"
  std::string_view title;  ///< with edition, as a report prints it
};

/// A citation "KEY, section" in its two parts.
struct Citation {
  std::string_view key;
  std::string_view section;  ///< may contain commas; empty when the whole document is meant
};

/// All documents, sorted by key.
[[nodiscard]] std::span<const SourceDocument> SourceDocuments();
/// Null when no document has that key.
[[nodiscard]] const SourceDocument* FindSourceDocument(std::string_view key);
/// The first citation of a source text ("AKD-2010, 4.5; MKD, 4.5"); the views point into `source`.
[[nodiscard]] Citation FirstCitation(std::string_view source);

}  // namespace ecaudit::device
