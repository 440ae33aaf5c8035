#include "cli/file_list.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "decoder/base/system/files.h"
#include "decoder/base/system/names.h"

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

using system::FileKind;
using system::FileStatus;

/// "-" would be standard input, so a file of that name keeps its folder.
std::string Shortest(const std::string& path) {
  // One spelling on all systems: names of reports are made from it.
  std::string normal = fs::path(path).lexically_normal().generic_string();
  return normal.empty() || normal == "-" ? path : normal;
}

class Expansion {
 public:
  Expansion(bool (*wanted)(std::string_view), std::string_view noun) : wanted_(wanted), noun_(noun) {}

  [[nodiscard]] std::optional<Error> Add(const std::string& path) {
    const std::optional<FileStatus> status = system::StatusOf(path);
    if (status && status->kind == FileKind::kFolder) {
      const std::size_t before = found_;
      AddFolder(fs::path(path).lexically_normal());
      if (found_ == before && list_.unreadable.empty()) return Error{"no " + noun_ + " in " + path};
    } else if (!status && path.find_first_of("*?[") != std::string::npos) {
      return AddMatches(path);
    } else {
      AddFile(path);
    }
    return std::nullopt;
  }

  [[nodiscard]] FileList Take() {
    std::ranges::sort(list_.files);
    std::ranges::sort(list_.passed_over);
    return std::move(list_);
  }

 private:
  void AddFolder(const fs::path& folder) {
    const auto names = system::NamesIn(folder.string());
    if (!names) {
      const std::string why = system::ReasonText(errno);
      list_.unreadable.push_back({folder.string(), "cannot read folder " + folder.string() + ": " + why});
      return;
    }
    for (const std::string& name : *names) {
      if (!name.starts_with('.')) AddEntry(folder / name, name);
    }
  }

  void AddEntry(const fs::path& entry, const std::string& name) {
    const std::string path = entry.generic_string();
    const std::optional<FileStatus> status = system::StatusOf(path);
    if (status && status->kind == FileKind::kFolder) {
      const std::optional<FileStatus> link = system::StatusOfLink(path);
      if (link && link->kind == FileKind::kLink) return PassOver(path, "a link to a folder");
      AddFolder(entry);
    } else if (wanted_(name)) {
      if (!status) return PassOver(path, "a link to nothing");
      if (status->kind != FileKind::kRegular) return PassOver(path, "a pipe or device");
      AddFile(path);
    } else if (wanted_ == IsCaptureName && IsForeignCaptureName(name)) {
      PassOver(path, "packed in a way that is not read: only gzip and zstd are");
    }
  }

  [[nodiscard]] std::optional<Error> AddMatches(const std::string& pattern) {
    const std::vector<std::string> matches = system::PathsMatching(pattern);
    if (matches.empty()) return Error{"nothing matches " + pattern};
    for (const std::string& path : matches) {
      if (auto error = Add(path)) return error;
    }
    return std::nullopt;
  }

  void PassOver(const std::string& path, std::string_view why) {
    list_.passed_over.push_back(path + " is ignored: it is " + std::string(why));
  }

  void AddFile(const std::string& path) {
    ++found_;
    std::error_code code;
    const fs::path real = fs::canonical(path, code);
    std::string shortest = Shortest(path);
    if (seen_.insert(code ? shortest : real.string()).second) list_.files.push_back(std::move(shortest));
  }

  bool (*wanted_)(std::string_view);
  std::string noun_;
  FileList list_;
  std::size_t found_ = 0;
  std::set<std::string> seen_;
};

std::string Lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Digits at the end of `text`.
std::size_t TrailingDigits(std::string_view text) {
  const std::size_t last = text.find_last_not_of("0123456789");
  return last == std::string_view::npos ? text.size() : text.size() - last - 1;
}

/// dumpcap's NAME_00001_20260302021307.ENDING, or the numbers the other way round, as NAME_*.ENDING; empty for others.
std::string DumpcapKey(std::string_view path) {
  constexpr std::size_t kDate = 14;
  constexpr std::size_t kLeastNumber = 5;
  const std::size_t name = path.size() - system::NameOf(path).size();
  for (std::size_t dot = path.rfind('.'); dot != std::string_view::npos && dot > name; dot = path.rfind('.', dot - 1)) {
    std::string_view stem = path.substr(0, dot);
    const std::size_t second = TrailingDigits(stem);
    stem.remove_suffix(second);
    if (!stem.ends_with('_')) continue;
    stem.remove_suffix(1);
    const std::size_t first = TrailingDigits(stem);
    stem.remove_suffix(first);
    const bool numbered = (first >= kLeastNumber && second == kDate) || (first == kDate && second >= kLeastNumber);
    if (!numbered || !stem.ends_with('_') || dot + 1 == path.size()) continue;
    return std::string(stem) + "*" + std::string(path.substr(dot));
  }
  return {};
}

/// tcpdump's NAME.pcap12, compressed or not, as NAME.pcap; empty for others.
std::string TcpdumpKey(std::string_view path) {
  std::string_view packed;
  for (const std::string_view ending : {".gz", ".zst"}) {
    if (path.ends_with(ending)) packed = ending;
  }
  std::string_view stem = path.substr(0, path.size() - packed.size());
  const std::size_t digits = TrailingDigits(stem);
  stem.remove_suffix(digits);
  return digits > 0 && stem.ends_with(".pcap") ? std::string(stem) + std::string(packed) : std::string();
}

/// The path without the numbers in which the files of one ring buffer differ.
std::string RingKey(const std::string& path) {
  if (std::string key = DumpcapKey(path); !key.empty()) return key;
  if (std::string key = TcpdumpKey(path); !key.empty()) return key;
  return path;
}

}  // namespace

Result<FileList> ExpandPaths(std::span<const std::string> paths, bool (*wanted)(std::string_view name),
                             std::string_view noun) {
  Expansion expansion(wanted, noun);
  for (const std::string& path : paths) {
    if (auto error = expansion.Add(path)) return *error;
  }
  return expansion.Take();
}

bool IsCaptureName(std::string_view name) {
  std::string text = Lower(name);
  for (const std::string_view packed : {".gz", ".zst"}) {
    if (text.ends_with(packed)) text.resize(text.size() - packed.size());
  }
  const std::size_t dot = text.rfind('.');
  if (dot == std::string::npos) return false;
  const std::string ending = text.substr(dot + 1);
  return ending == "pcapng" || ending == "cap" ||
         (ending.starts_with("pcap") && ending.find_first_not_of("0123456789", 4) == std::string::npos);
}

bool IsForeignCaptureName(std::string_view name) {
  const std::string text = Lower(name);
  for (const std::string_view packed : {".xz", ".bz2", ".lz4", ".lzma", ".zip", ".7z"}) {
    if (text.ends_with(packed)) return IsCaptureName(text.substr(0, text.size() - packed.size()));
  }
  return false;
}

std::vector<std::vector<std::string>> GroupRingBuffers(std::span<const std::string> files) {
  std::vector<std::vector<std::string>> groups;
  std::map<std::string, std::size_t> place;
  for (const std::string& file : files) {
    const auto [entry, first] = place.emplace(RingKey(file), groups.size());
    if (first) groups.emplace_back();
    groups[entry->second].push_back(file);
  }
  return groups;
}

bool IsReportName(std::string_view name) {
  return Lower(name).ends_with(".json");
}

}  // namespace ecaudit::cli
