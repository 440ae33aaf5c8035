/// Findings with any title and message, for tests of what comes after the rules.
#pragma once

#include <deque>
#include <string>
#include <string_view>

#include "analyzers/result/finding.h"

namespace ecaudit::test {

/// As a template that writes just this text.
inline std::string Escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '{' || c == '[' || c == ']' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

/// What the sentences of `finding` are to be. Blanks and line breaks become one blank.
/// @param identity  what distinguishes it from others of its rule; the title where it is empty
inline void SetTexts(Finding& finding, std::string_view title, std::string_view message = {},
                     std::string_view identity = {}) {
  struct Owned {
    std::string name, title, message;
    FindingKind kind;
  };
  static std::deque<Owned> all;  // findings keep the addresses
  Owned& owned = all.emplace_back();
  owned.name = identity.empty() ? title : identity;
  owned.title = Escaped(title);
  owned.message = Escaped(message);
  owned.kind = {.name = owned.name, .title = owned.title, .message = owned.message, .next = {}};
  finding.kind = &owned.kind;
}

}  // namespace ecaudit::test
