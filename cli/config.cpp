#include "cli/config.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "cli/json_file.h"
#include "cli/suggest.h"
#include "decoder/base/system/files.h"

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFileName = ".ecaudit.json";
constexpr std::array<std::string_view, 12> kKeys{"profile", "profiles",  "slave_profiles", "parameters", "rules",
                                                 "fail_on", "require",   "baseline",       "limits",     "esi",
                                                 "eni",     "count_from"};

/// Limits that rules let a project change; each rule's page (`ecaudit explain`) shows its own.
constexpr std::array<std::string_view, 11> kLimits{"al-timeout.preop",
                                                   "al-timeout.safeop-op",
                                                   "al-timeout.down",
                                                   "drive-mode-not-shown",
                                                   "drive-no-reaction",
                                                   "drive-no-reaction.stop",
                                                   "foe-error",
                                                   "latch-ack-mismatch",
                                                   "mailbox-no-response",
                                                   "sync-difference-large",
                                                   "sync-drift-uncompensated"};
constexpr double kLargestLimitMs = 1e9;  // 11 days

Error Wrong(const std::string& path, const std::string& what) {
  return Error{path + ": " + what};
}

/// Reads {"KEY": "VALUE", ...} as "KEY=VALUE" lines.
std::optional<Error> ReadAssignments(JsonValue value, const std::string& name, const std::string& path,
                                     std::vector<std::string>& out) {
  if (!value.is_object()) return Wrong(path, "'" + name + "' must be an object");
  for (const auto& [key, text] : value.Members()) {
    if (!text.is_text()) return Wrong(path, "'" + name + "': the value of '" + std::string(key) + "' must be a string");
    out.push_back(std::string(key).append("=").append(*text.text()));
  }
  return std::nullopt;
}

/// Reads {"[SLAVE:]NAME": whole number, ...}.
std::optional<Error> ReadParameters(JsonValue value, Config& config) {
  if (!value.is_object()) return Wrong(config.path, "'parameters' must be an object");
  for (const auto& [name, number] : value.Members()) {
    const std::optional<std::uint64_t> natural = number.natural();
    if (!natural) {
      return Wrong(config.path, "'parameters': the value of '" + std::string(name) + "' must be a whole number");
    }
    config.parameters.push_back(std::string(name) + "=" + std::to_string(*natural));
  }
  return std::nullopt;
}

/// Reads {"NAME": milliseconds, ...}.
std::optional<Error> ReadLimits(JsonValue value, Config& config) {
  if (!value.is_object()) return Wrong(config.path, "'limits' must be an object");
  for (const auto& [name, limit] : value.Members()) {
    if (std::ranges::find(kLimits, name) == kLimits.end()) {
      return Wrong(config.path, "unknown limit '" + std::string(name) + "'" + Suggestion(name, kLimits, ""));
    }
    const double ms = limit.number().value_or(0.0);
    if (!(ms > 0 && ms <= kLargestLimitMs)) {
      return Wrong(config.path, "'limits': the value of '" + std::string(name) + "' must be a number of milliseconds");
    }
    config.limits[std::string(name)] = static_cast<std::int64_t>(ms * 1e6);
  }
  return std::nullopt;
}

/// Reads "FILE" or ["FILE", ...].
std::optional<Error> ReadPaths(JsonValue value, const std::string& name, const Config& config,
                               std::vector<std::string>& out) {
  for (const JsonValue file : value.is_array() ? value.Elements() : std::vector{value}) {
    if (!file.is_text()) return Wrong(config.path, "'" + name + "' must be a file name or a list of them");
    out.push_back((fs::path(config.path).parent_path() / *file.text()).string());
  }
  return std::nullopt;
}

}  // namespace

Result<Config> ReadConfig(const std::string& path) {
  const Result<JsonDocument> document = ReadJsonFile(path);
  if (!document) return document.error();
  if (!document->root().is_object()) return Wrong(path, "the document must be an object");

  Config config;
  config.path = path;
  for (const auto& [member, value] : document->root().Members()) {
    const std::string key(member);
    std::optional<Error> error;
    if (key == "rules") {
      error = ReadAssignments(value, key, path, config.rules);
    } else if (key == "slave_profiles") {
      error = ReadAssignments(value, key, path, config.profiles);
    } else if (key == "parameters") {
      error = ReadParameters(value, config);
    } else if (key == "count_from") {
      const std::optional<std::uint64_t> number = value.natural();
      if (!number) return Wrong(path, "'count_from' must be 0 or 1");
      config.count_from = std::to_string(*number);
    } else if (key == "limits") {
      error = ReadLimits(value, config);
    } else if (key == "esi") {
      error = ReadPaths(value, key, config, config.esi);
    } else if (key == "profiles") {
      error = ReadPaths(value, key, config, config.families);
    } else if (key == "profile" || key == "fail_on" || key == "require" || key == "baseline" || key == "eni") {
      if (!value.is_text()) return Wrong(path, "'" + key + "' must be a string");
      const std::string text(*value.text());
      if (key == "profile") config.profiles.push_back(text);
      if (key == "fail_on") config.fail_on = text;
      if (key == "require") config.require = text;
      if (key == "eni") config.eni = (fs::path(path).parent_path() / text).string();
      if (key == "baseline") config.baseline = (fs::path(path).parent_path() / text).string();
    } else {
      return Wrong(path, "unknown key '" + key + "'" + Suggestion(key, kKeys, ""));
    }
    if (error) return *error;
  }
  return config;
}

std::optional<std::string> FindConfig(const std::string& capture) {
  std::error_code code;
  const fs::path start = capture == "-" ? fs::current_path(code) : fs::absolute(capture, code).parent_path();
  if (code) return std::nullopt;
  for (fs::path folder = start.lexically_normal();; folder = folder.parent_path()) {
    const fs::path candidate = folder / kFileName;
    // A folder of that name, or a link to nothing, is meant as a configuration: reading it shows what is wrong.
    const std::string path = candidate.string();
    const std::optional<system::FileStatus> status = system::StatusOf(path);
    const bool dangling = !status && system::StatusOfLink(path).has_value();
    using enum system::FileKind;
    if (dangling || (status && (status->kind == kRegular || status->kind == kFolder))) return path;
    if (folder == folder.root_path() || folder.empty()) return std::nullopt;
  }
}

std::optional<Error> CheckConfigOwner(const std::string& path) {
  const std::optional<system::FileStatus> link = system::StatusOfLink(path);
  const std::optional<system::FileStatus> file = system::StatusOf(path);
  if (!link || !file) return std::nullopt;
  std::string why;
  if (link->foreign || file->foreign) why = "belongs to another user";
  if (why.empty() && file->kind == system::FileKind::kRegular && file->writable_by_all)
    why = "is writable by all users";
  if (why.empty()) return std::nullopt;
  return Error{path + " " + why + ", and its settings would change the result; --config " + path +
               " uses it, --config with a file of your own replaces it"};
}

}  // namespace ecaudit::cli
