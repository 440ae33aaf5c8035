#include "cli/command_files.h"

#include <filesystem>
#include <system_error>

#include "cli/output_file.h"
#include "decoder/base/system/files.h"

namespace ecaudit::cli {

CommandFiles::Identity CommandFiles::IdentityOf(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path absolute = fs::absolute(ResolveLinks(path), ignored);
  const fs::path resolved = fs::weakly_canonical(absolute, ignored);
  // The spelling stands in where a name cannot be resolved, as in a folder that may not be read.
  Identity identity{(resolved.empty() ? absolute.lexically_normal() : resolved).string(), std::nullopt};
  if (const auto status = system::StatusOf(path)) identity.node = status->node;
  return identity;
}

const std::string* CommandFiles::RoleOf(const Identity& identity) const {
  if (const auto role = by_name_.find(identity.name); role != by_name_.end()) return &role->second;
  if (!identity.node) return nullptr;
  const auto role = by_node_.find(*identity.node);
  return role == by_node_.end() ? nullptr : &role->second;
}

void CommandFiles::Add(const Identity& identity, std::string_view role) {
  by_name_.insert_or_assign(identity.name, std::string(role));
  if (identity.node) by_node_.insert_or_assign(*identity.node, std::string(role));
}

void CommandFiles::Reads(const std::string& path, std::string_view role) {
  if (!path.empty() && path != "-") Add(IdentityOf(path), role);
}

void CommandFiles::Reads(const std::vector<std::string>& paths, std::string_view role) {
  for (const std::string& path : paths) Reads(path, role);
}

std::optional<Error> CommandFiles::ReadsJoined(const std::vector<std::string>& captures) {
  for (const std::string& capture : captures) {
    if (capture == "-") continue;
    const Identity identity = IdentityOf(capture);
    if (RoleOf(identity) != nullptr) return Error{capture + " is joined twice: --join reads each file once"};
    Add(identity, kCaptureRole);
  }
  return std::nullopt;
}

std::optional<Error> CommandFiles::Writes(const std::string& path, std::string_view updates) {
  if (auto error = CheckOutputPath(path)) return error;
  return Claims(path, updates);
}

std::optional<Error> CommandFiles::Claims(const std::string& path, std::string_view updates) {
  const Identity identity = IdentityOf(path);
  const std::string* role = RoleOf(identity);
  if (role != nullptr && role->empty()) return Error{"two outputs have the same path " + path};
  if (role != nullptr && *role != updates) return Error{path + " is read as " + *role + "; name another output file"};
  Add(identity, "");
  return std::nullopt;
}

}  // namespace ecaudit::cli
