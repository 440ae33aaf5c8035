#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <utility>

#include "decoder/base/system/files.h"
#include "decoder/base/system/names.h"

namespace ecaudit::system {
namespace {

namespace fs = std::filesystem;

char Lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

/// Whether `c` is in the set that begins after '[' at the front of `pattern`; takes the set off. A '[' without ']'
/// stands for itself.
bool TakeSet(std::string_view& pattern, char c) {
  const std::size_t first = pattern.starts_with('!') || pattern.starts_with('^') ? 1 : 0;
  const std::size_t end = pattern.find(']', first + 1);
  if (end == std::string_view::npos) return c == '[';
  bool in = false;
  for (std::size_t at = first; at < end; ++at) {
    const bool range = at + 2 < end && pattern[at + 1] == '-';
    const char last = Lower(pattern[range ? at + 2 : at]);
    in = in || (Lower(pattern[at]) <= Lower(c) && Lower(c) <= last);
    if (range) at += 2;
  }
  pattern.remove_prefix(end + 1);
  return in != (first == 1);
}

bool Matches(std::string_view name, std::string_view pattern) {
  // A star that may take one more character, if what follows it does not fit.
  std::string_view star_name;
  std::string_view star_pattern;
  bool starred = false;
  while (!name.empty() || !pattern.empty()) {
    if (pattern.starts_with('*')) {
      pattern.remove_prefix(1);
      starred = true;
      star_name = name;
      star_pattern = pattern;
      continue;
    }
    bool fits = !name.empty() && !pattern.empty();
    if (fits) {
      const char c = name.front();
      const char wanted = pattern.front();
      pattern.remove_prefix(1);
      fits = wanted == '[' ? TakeSet(pattern, c) : wanted == '?' || Lower(wanted) == Lower(c);
      name.remove_prefix(1);
    }
    if (fits) continue;
    if (!starred || star_name.empty()) return false;
    star_name.remove_prefix(1);
    name = star_name;
    pattern = star_pattern;
  }
  return true;
}

/// Adds what matches the parts of a pattern from `part` on, below `folder`.
void AddMatching(const fs::path& folder, fs::path::const_iterator part, fs::path::const_iterator end,
                 std::vector<std::string>& paths) {
  if (part == end) {
    if (Exists(folder.string())) paths.push_back(folder.generic_string());
    return;
  }
  const std::string pattern = part->string();
  const auto next = std::next(part);
  if (pattern.find_first_of("*?[") == std::string::npos) return AddMatching(folder / *part, next, end, paths);
  for (const std::string& name : NamesIn(folder.string()).value_or(std::vector<std::string>())) {
    if (name.starts_with('.') && !pattern.starts_with('.')) continue;
    if (Matches(name, pattern)) AddMatching(folder / name, next, end, paths);
  }
}

}  // namespace

std::string_view NameOf(std::string_view path) {
  const std::size_t separator = path.find_last_of("/\\:");
  return separator == std::string_view::npos ? path : path.substr(separator + 1);
}

bool MatchesPattern(const std::string& name, const std::string& pattern) {
  return Matches(name, pattern);
}

std::vector<std::string> PathsMatching(const std::string& pattern) {
  const fs::path path(pattern);
  const fs::path relative = path.relative_path();
  std::vector<std::string> paths;
  AddMatching(path.root_path(), relative.begin(), relative.end(), paths);
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::vector<std::string> TypedPaths(std::vector<std::string> typed) {
  std::vector<std::string> paths;
  for (std::string& path : typed) {
    const bool pattern = path.find_first_of("*?") != std::string::npos;
    std::vector<std::string> matches = pattern ? PathsMatching(path) : std::vector<std::string>();
    if (path.find('\\') != std::string::npos) {
      for (std::string& match : matches) std::replace(match.begin(), match.end(), '/', '\\');
    }
    if (matches.empty()) matches.push_back(std::move(path));
    paths.insert(paths.end(), matches.begin(), matches.end());
  }
  return paths;
}

}  // namespace ecaudit::system
