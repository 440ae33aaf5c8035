#include <fnmatch.h>
#include <glob.h>

#include "decoder/base/system/names.h"

namespace ecaudit::system {

std::string_view NameOf(std::string_view path) {
  const std::size_t separator = path.rfind('/');
  return separator == std::string_view::npos ? path : path.substr(separator + 1);
}

bool MatchesPattern(const std::string& name, const std::string& pattern) {
  return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

std::vector<std::string> PathsMatching(const std::string& pattern) {
  glob_t matches{};
  std::vector<std::string> paths;
  if (::glob(pattern.c_str(), 0, nullptr, &matches) == 0) {
    paths.assign(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
  }
  ::globfree(&matches);
  return paths;
}

std::vector<std::string> TypedPaths(std::vector<std::string> typed) {
  return typed;
}

}  // namespace ecaudit::system
