/// The configuration file of a project, `.ecaudit.json`. docs/configuration.md describes it for users.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/result.h"

namespace ecaudit::cli {

/// What a file states, checked for its shape; the names in it are checked where options are (capture_options.h).
struct Config {
  std::string path;                                         ///< of the file
  std::vector<std::string> parameters;                      ///< "[SLAVE:]NAME=VALUE"
  std::vector<std::string> profiles;                        ///< as --profile: "NAME" or "SLAVE=NAME"
  std::vector<std::string> families;                        ///< as --profiles; the file has it relative to its folder
  std::vector<std::string> rules;                           ///< as --rule: "ID=SEVERITY"
  std::optional<std::string> fail_on;                       ///< as --fail-on
  std::optional<std::string> count_from;                    ///< as --count-from; the file has a number
  std::optional<std::string> require;                       ///< as --require
  std::optional<std::string> baseline;                      ///< as --baseline; the file has it relative to its folder
  std::vector<std::string> esi;                             ///< as --esi, likewise
  std::optional<std::string> eni;                           ///< as --eni, likewise
  std::map<std::string, std::int64_t, std::less<>> limits;  ///< ns by name; the file has milliseconds
};

/// Reads `path`. An unknown key or a value of the wrong type is an error: a typing mistake must not switch a check off.
[[nodiscard]] Result<Config> ReadConfig(const std::string& path);

/// The nearest `.ecaudit.json` beside `capture` or in a folder above it; for "-" from the current folder on.
[[nodiscard]] std::optional<std::string> FindConfig(const std::string& capture);

/// A user with write access to the folder of a capture, or above it, could switch rules off there: a file that was
/// found and not named has to be the user's own or root's, and must not be writable by all users.
/// @return what is wrong with it, or nothing
[[nodiscard]] std::optional<Error> CheckConfigOwner(const std::string& path);

}  // namespace ecaudit::cli
