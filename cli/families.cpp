#include "cli/families.h"

#include <filesystem>

#include "cli/suggest.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/program.h"

namespace ecaudit::cli {
namespace {

/// Where an installed program finds families for all of its users: beside its folder (bin/), or beside itself where it
/// lies at the top of an archive, so that the tree can be moved.
std::string SystemFolder() {
  const std::filesystem::path program = system::ProgramPath();
  if (program.empty()) return {};
  const std::filesystem::path own = program.parent_path();
  for (const std::filesystem::path& top : {own.parent_path(), own}) {
    const std::filesystem::path folder = top / "share" / "ecaudit" / "profiles";
    if (system::IsFolder(folder.string())) return folder.string();
  }
  return {};
}

}  // namespace

Result<device::ProfileRegistry> LoadFamilies(const std::vector<std::string>& paths) {
  device::ProfileRegistry families;
  if (const std::string folder = SystemFolder(); !folder.empty()) {
    if (auto error = families.AddPath(folder)) return *error;
  }
  for (const std::string& path : paths) {
    if (auto error = families.AddPath(path)) return *error;
  }
  return families;
}

Error UnknownProfile(const device::ProfileRegistry& families, std::string_view name) {
  const std::vector<std::string> names = families.Names();
  const std::vector<std::string_view> views(names.begin(), names.end());
  return Error{"unknown profile '" + std::string(name) + "'" + Suggestion(name, views, "ecaudit profiles")};
}

}  // namespace ecaudit::cli
