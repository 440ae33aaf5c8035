/// The drive families that come with the program, and those a user adds.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/result.h"
#include "decoder/device/device_description.h"

namespace ecaudit::device {

/// Names of the built-in profiles, in alphabetical order; "generic" is one of them.
[[nodiscard]] const std::vector<std::string>& BuiltinProfileNames();
/// Those of one maker. Asking parses none of them.
[[nodiscard]] std::vector<std::string> BuiltinProfilesOf(std::uint32_t vendor_id);
/// Whether it has rows of this object itself, not from the profile that it extends; false for any other name. Asking
/// parses none of them.
[[nodiscard]] bool BuiltinProfileLists(std::string_view name, std::uint16_t index);
/// A built-in profile, parsed at first use and kept; null when there is none of that name. Safe from several threads.
[[nodiscard]] const DeviceDescription* BuiltinProfile(std::string_view name);
/// The JSON text of a built-in profile as it was written; empty when there is none of that name.
[[nodiscard]] std::string BuiltinProfileText(std::string_view name);

/// Reads one profile file that may extend a built-in profile. Fails with "PATH: reason".
[[nodiscard]] Result<DeviceDescription> LoadProfileFile(const std::string& path);

/// Built-in profiles plus the user's. A user's profile hides a built-in one with the same id.
class ProfileRegistry {
 public:
  /// A family that did not come with the program.
  struct Own {
    std::string path;
    std::string text;                                      ///< of the file
    std::shared_ptr<const DeviceDescription> description;  ///< shared by copies of the registry
  };

  /// A file, or a folder of them: AddFile() or AddDirectory().
  [[nodiscard]] std::optional<Error> AddPath(const std::string& path);
  /// Reads all *.json files of a folder, in any order; they may extend each other and built-in profiles.
  /// Hidden files are left out, and copies of built-in profiles, which change nothing.
  /// Fails, adding none, on the first file that cannot be read, a cycle of "extends", or an id that two files share.
  [[nodiscard]] Result<std::size_t> AddDirectory(const std::string& path);
  /// Adds one file, that may extend what is already there; returns its id.
  [[nodiscard]] Result<std::string> AddFile(const std::string& path);

  /// Null when there is none of that name. The pointer stays valid as long as the registry.
  [[nodiscard]] const DeviceDescription* Find(std::string_view id) const;
  /// The JSON text that a profile was read from; empty when there is none of that name.
  [[nodiscard]] std::string Text(std::string_view id) const;
  /// Those that were added, by id.
  [[nodiscard]] const std::map<std::string, Own, std::less<>>& own() const { return own_; }
  /// Alphabetical.
  [[nodiscard]] std::vector<std::string> Names() const;
  /// Profiles whose documented identity is this one: added ones before built-in ones, newest edition first; empty when
  /// nothing fits (use "generic").
  [[nodiscard]] std::vector<const DeviceDescription*> MatchIdentity(std::uint32_t vendor_id, std::uint32_t product_code,
                                                                    std::uint32_t revision) const;
  /// Profiles whose list of models contains a beginning of `model` (EEPROM category 0x0800, object 1008h).
  [[nodiscard]] std::vector<const DeviceDescription*> MatchModel(std::string_view model) const;

 private:
  template <typename Predicate>
  [[nodiscard]] std::vector<const DeviceDescription*> Match(Predicate fits) const;

  std::map<std::string, Own, std::less<>> own_;
};

/// ProfileRegistry::MatchIdentity() over the built-in profiles only.
[[nodiscard]] std::vector<const DeviceDescription*> MatchIdentity(std::uint32_t vendor_id, std::uint32_t product_code,
                                                                  std::uint32_t revision);

}  // namespace ecaudit::device
