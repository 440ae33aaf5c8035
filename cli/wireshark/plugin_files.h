/// The post-dissector and what comes with it: where Wireshark looks for them, and the lists that it reads.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cli/wireshark/side_rows.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

inline constexpr std::string_view kPluginFile = "ecaudit.lua";

/// What is needed to recognise a capture by its first frame.
struct FirstFrame {
  std::string time;  ///< seconds since 1970 with nine decimals; empty: it has none
  std::uint32_t length = 0;
};

class PluginFiles {
 public:
  /// @param folder  of the plugin; empty: Wireshark's personal plugin folder
  [[nodiscard]] static Result<PluginFiles> In(const std::string& folder);

  [[nodiscard]] const std::string& folder() const { return folder_; }
  [[nodiscard]] std::string plugin() const;
  /// The plugin is there.
  [[nodiscard]] bool installed() const;
  /// The plugin is there and is not the one of this program.
  [[nodiscard]] bool differs() const;

  /// Writes the plugin, and into Wireshark's own folders also a profile "ecaudit" with columns and colours; files of a
  /// profile that exist are kept.
  [[nodiscard]] std::optional<Error> Install() const;
  [[nodiscard]] const std::string& profile() const { return profile_; }

  /// Adds what is new to the list of fields that the plugin registers.
  /// @return how many were added
  [[nodiscard]] Result<std::size_t> AddFields(const std::vector<SignalField>& fields) const;
  /// Adds the capture to the list by which the plugin finds side files.
  [[nodiscard]] std::optional<Error> AddCapture(const FirstFrame& first, const std::string& side_file) const;

 private:
  std::string folder_;
  std::string profile_;  ///< its folder; empty: none is written
};

}  // namespace ecaudit::cli
