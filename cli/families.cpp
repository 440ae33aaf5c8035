#include "cli/families.h"

#include <vector>

#include "cli/suggest.h"

namespace ecaudit::cli {

Error UnknownProfile(const device::ProfileRegistry& families, std::string_view name) {
  const std::vector<std::string> names = families.Names();
  const std::vector<std::string_view> views(names.begin(), names.end());
  return Error{"unknown profile '" + std::string(name) + "'" + Suggestion(name, views, "ecaudit profiles")};
}

}  // namespace ecaudit::cli
