#include "cli/report/project_path.h"

#include <filesystem>

namespace ecaudit::report {

std::string PathInProject(std::string_view path, std::string_view folder) {
  std::filesystem::path full(path);
  // On Windows "\captures\a.pcap" is on the drive of the folder.
  if (full.has_root_directory() && !full.is_absolute()) full = std::filesystem::path(folder).root_name() / full;
  std::string normal = full.lexically_normal().generic_string();
  std::string root(folder);
  if (!root.empty() && root.back() != '/') root += '/';
  if (root.size() > 1 && normal.size() > root.size() && normal.starts_with(root)) normal.erase(0, root.size());
  return normal;
}

}  // namespace ecaudit::report
