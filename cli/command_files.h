/// All files of one command line: what is read, or written already, is never written to.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "decoder/base/result.h"

namespace ecaudit::cli {

/// A command first registers its inputs, then its outputs, both before any work is done.
class CommandFiles {
 public:
  /// @param path  "-" and "" are no files
  /// @param role  for messages: "a capture", "an ENI file"
  void Reads(const std::string& path, std::string_view role);
  void Reads(const std::vector<std::string>& paths, std::string_view role);
  /// Captures that are joined.
  /// @return the first that is named twice
  [[nodiscard]] std::optional<Error> ReadsJoined(const std::vector<std::string>& captures);

  /// Asks whether `path` can be written (CheckOutputPath()) and is none of the other files of this command line, links
  /// followed.
  /// @param updates  a file that is read in this role may be replaced: the baseline that is brought up to date
  [[nodiscard]] std::optional<Error> Writes(const std::string& path, std::string_view updates = "");
  /// The same without asking whether it can be written: for files whose names the program makes.
  [[nodiscard]] std::optional<Error> Claims(const std::string& path, std::string_view updates = "");

 private:
  using Node = std::pair<std::uint64_t, std::uint64_t>;  ///< device and number: two names may be one file
  struct Identity {
    std::string name;  ///< links resolved
    std::optional<Node> node;
  };
  [[nodiscard]] static Identity IdentityOf(const std::string& path);
  [[nodiscard]] const std::string* RoleOf(const Identity& identity) const;
  void Add(const Identity& identity, std::string_view role);

  // The role of each file; empty: it is written.
  std::map<std::string, std::string> by_name_;
  std::map<Node, std::string> by_node_;
};

/// Roles that more than one command knows.
inline constexpr std::string_view kCaptureRole = "a capture";
inline constexpr std::string_view kReportRole = "a report";
inline constexpr std::string_view kConfigRole = "the configuration file";
inline constexpr std::string_view kBaselineRole = "the baseline";
inline constexpr std::string_view kEsiRole = "an ESI file";
inline constexpr std::string_view kEniRole = "the ENI file";
inline constexpr std::string_view kFamilyRole = "a drive family";
inline constexpr std::string_view kExpectationRole = "the expectation";

}  // namespace ecaudit::cli
