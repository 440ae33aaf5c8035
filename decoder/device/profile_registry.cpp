#include "decoder/device/profile_registry.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <mutex>
#include <set>
#include <utility>

#include "decoder/base/bytes.h"
#include "decoder/base/json.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"
#include "decoder/device/description_file.h"
#include "decoder/device/embedded_files.h"
#include "decoder/device/profile_reader.h"

namespace ecaudit::device {
namespace {

/// A profile of all objects of a large drive has about 300 kB.
constexpr std::uintmax_t kMaxProfileBytes = 16U << 20U;

struct Builtin {
  std::once_flag once;
  std::unique_ptr<const DeviceDescription> description;
};

/// Never destroyed: that would be wasted work at the end of a program.
std::map<std::string, Builtin, std::less<>>& Builtins() {
  static auto* const builtins = [] {
    auto* made = new std::map<std::string, Builtin, std::less<>>;
    for (const std::string& name : BuiltinProfileNames()) (*made)[name];
    return made;
  }();
  return *builtins;
}

Error At(const std::filesystem::path& path, const Error& error) {
  return Error{Printable(path.string()) + ": " + error.message};
}

/// Heads of the built-in profiles: choosing one must not cost reading all of them.
const std::vector<ProfileHead>& BuiltinHeads() {
  static const std::vector<ProfileHead> heads = [] {
    std::vector<ProfileHead> read;
    for (const std::string& name : BuiltinProfileNames()) {
      const std::optional<JsonDocument> document = ReadCbor(EmbeddedHeadCbor(name));
      if (!document) continue;
      if (Result<ProfileHead> head = ReadProfileHead(*document)) read.push_back(std::move(*head));
    }
    return read;
  }();
  return heads;
}

template <typename Profiles>
void SortNewestFirst(Profiles& profiles) {
  std::ranges::stable_sort(profiles, [](const DeviceDescription* a, const DeviceDescription* b) {
    return a->edition != b->edition ? a->edition > b->edition : a->id < b->id;  // ISO dates sort as text
  });
}

}  // namespace

const std::vector<std::string>& BuiltinProfileNames() {
  static const std::vector<std::string> names = EmbeddedProfileNames();
  return names;
}

std::vector<std::string> BuiltinProfilesOf(std::uint32_t vendor_id) {
  std::vector<std::string> names;
  for (const ProfileHead& head : BuiltinHeads()) {
    if (head.match.vendor_id == vendor_id) names.push_back(head.id);
  }
  return names;
}

bool BuiltinProfileLists(std::string_view name, std::uint16_t index) {
  const std::string_view objects = EmbeddedObjects(name);
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(objects.data());
  std::size_t first = 0;
  for (std::size_t count = objects.size() / 2; count > 0;) {
    const std::size_t half = count / 2;
    if (LoadLittleEndian<std::uint16_t>(bytes + 2 * (first + half)) < index) {
      first += half + 1;
      count -= half + 1;
    } else {
      count = half;
    }
  }
  return first < objects.size() / 2 && LoadLittleEndian<std::uint16_t>(bytes + 2 * first) == index;
}

const DeviceDescription* BuiltinProfile(std::string_view name) {
  const auto it = Builtins().find(name);
  if (it == Builtins().end()) return nullptr;
  Builtin& builtin = it->second;
  std::call_once(builtin.once, [&] {
    // Tests parse every built-in profile, so a failure cannot ship; an "extends" cycle would hang here.
    const std::optional<JsonDocument> document = ReadCbor(EmbeddedProfileCbor(name));
    if (!document) return;
    Result<DeviceDescription> read = ReadProfile(*document, BuiltinProfile);
    if (read) builtin.description = std::make_unique<const DeviceDescription>(std::move(*read));
  });
  return builtin.description.get();
}

std::string BuiltinProfileText(std::string_view name) {
  return std::string(EmbeddedProfileText(name));
}

Result<DeviceDescription> LoadProfileFile(const std::string& path) {
  Result<std::string> text = ReadDescriptionFile(path, kMaxProfileBytes);
  if (!text) return text.error();
  Result<DeviceDescription> profile = ReadProfile(*text);
  if (!profile) return At(path, profile.error());
  return profile;
}

Result<std::string> ProfileRegistry::AddFile(const std::string& path) {
  Result<std::string> text = ReadDescriptionFile(path, kMaxProfileBytes);
  if (!text) return text.error();
  Result<DeviceDescription> profile = ReadProfile(*text, [this](std::string_view id) { return Find(id); });
  if (!profile) return At(path, profile.error());
  std::string id = profile->id;
  own_[id] = {path, std::move(*text), std::make_shared<const DeviceDescription>(std::move(*profile))};
  return id;
}

std::optional<Error> ProfileRegistry::AddPath(const std::string& path) {
  if (system::IsFolder(path)) {
    const Result<std::size_t> added = AddDirectory(path);
    return added ? std::nullopt : std::optional(added.error());
  }
  const Result<std::string> added = AddFile(path);
  return added ? std::nullopt : std::optional(added.error());
}

Result<std::size_t> ProfileRegistry::AddDirectory(const std::string& path) {
  struct Pending {
    std::filesystem::path path;
    std::string text;
    std::string extends;
  };
  const auto names = system::NamesIn(path);
  if (!names) return Error{Printable(path) + ": " + system::ReasonText(errno)};

  std::map<std::string, Pending, std::less<>> pending;
  std::vector<std::filesystem::path> files;
  for (const std::string& name : *names) {
    if (!name.starts_with('.') && name.ends_with(".json")) files.push_back(std::filesystem::path(path) / name);
  }
  for (const std::filesystem::path& file : files) {
    Result<std::string> text = ReadDescriptionFile(file, kMaxProfileBytes);
    if (!text) return text.error();
    Result<ProfileHead> head = ReadProfileHead(*text);
    if (!head) return At(file, head.error());
    if (EmbeddedProfileText(head->id) == *text) continue;
    const auto [it, added] = pending.try_emplace(head->id, Pending{file, *text, head->extends});
    if (!added) {
      return At(file, Error{"id \"" + Printable(head->id) + "\" is also that of " + it->second.path.string()});
    }
  }

  std::map<std::string, std::unique_ptr<const DeviceDescription>, std::less<>> read;
  const auto lookup = [&](std::string_view id) -> const DeviceDescription* {
    const auto it = read.find(id);
    return it != read.end() ? it->second.get() : Find(id);
  };
  while (read.size() < pending.size()) {
    bool progress = false;
    for (const auto& [id, file] : pending) {
      // A file may extend the built-in profile that it hides, so "extends its own id" is no cycle.
      const bool waits = file.extends != id && pending.contains(file.extends) && !read.contains(file.extends);
      if (read.contains(id) || waits) continue;
      Result<DeviceDescription> profile = ReadProfile(file.text, lookup);
      if (!profile) return At(file.path, profile.error());
      read[id] = std::make_unique<const DeviceDescription>(std::move(*profile));
      progress = true;
    }
    if (progress) continue;
    for (const auto& [id, file] : pending) {
      if (!read.contains(id))
        return At(file.path, Error{"extends: \"" + Printable(id) + "\" extends itself in a cycle"});
    }
  }
  const std::size_t count = read.size();
  for (auto& [id, description] : read) {
    Pending& file = pending.find(id)->second;
    own_[id] = {file.path.string(), std::move(file.text), std::move(description)};
  }
  return count;
}

const DeviceDescription* ProfileRegistry::Find(std::string_view id) const {
  const auto it = own_.find(id);
  return it != own_.end() ? it->second.description.get() : BuiltinProfile(id);
}

std::string ProfileRegistry::Text(std::string_view id) const {
  const auto it = own_.find(id);
  return it != own_.end() ? it->second.text : std::string(EmbeddedProfileText(id));
}

std::vector<std::string> ProfileRegistry::Names() const {
  std::set<std::string> names(BuiltinProfileNames().begin(), BuiltinProfileNames().end());
  for (const auto& [id, own] : own_) names.insert(id);
  return {names.begin(), names.end()};
}

template <typename Predicate>
std::vector<const DeviceDescription*> ProfileRegistry::Match(Predicate fits) const {
  std::vector<const DeviceDescription*> matches;
  for (const auto& [id, own] : own_) {
    if (fits(own.description->match)) matches.push_back(own.description.get());
  }
  SortNewestFirst(matches);
  std::vector<const DeviceDescription*> builtin;
  for (const ProfileHead& head : BuiltinHeads()) {
    if (own_.contains(head.id) || !fits(head.match)) continue;
    if (const DeviceDescription* profile = BuiltinProfile(head.id)) builtin.push_back(profile);
  }
  SortNewestFirst(builtin);
  // A family that the user adds for this drive takes precedence, whatever the date of its manual.
  matches.insert(matches.end(), builtin.begin(), builtin.end());
  return matches;
}

std::vector<const DeviceDescription*> ProfileRegistry::MatchIdentity(std::uint32_t vendor_id,
                                                                     std::uint32_t product_code,
                                                                     std::uint32_t revision) const {
  return Match([&](const IdentityMatch& match) { return match.MatchesIdentity(vendor_id, product_code, revision); });
}

std::vector<const DeviceDescription*> ProfileRegistry::MatchModel(std::string_view model) const {
  return Match([&](const IdentityMatch& match) { return match.MatchesModel(model); });
}

std::vector<const DeviceDescription*> MatchIdentity(std::uint32_t vendor_id, std::uint32_t product_code,
                                                    std::uint32_t revision) {
  return ProfileRegistry().MatchIdentity(vendor_id, product_code, revision);
}

}  // namespace ecaudit::device
