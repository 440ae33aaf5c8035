#include "cli/file_list.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <glob.h>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <system_error>
#include <utility>

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

/// "-" would be standard input, so a file of that name keeps its folder.
std::string Shortest(const std::string& path) {
  std::string normal = fs::path(path).lexically_normal().string();
  return normal.empty() || normal == "-" ? path : normal;
}

class Expansion {
 public:
  Expansion(bool (*wanted)(std::string_view), std::string_view noun) : wanted_(wanted), noun_(noun) {}

  [[nodiscard]] std::optional<Error> Add(const std::string& path) {
    std::error_code code;
    const fs::file_status status = fs::status(path, code);
    if (fs::is_directory(status)) {
      const std::size_t before = found_;
      AddFolder(fs::path(path).lexically_normal());
      if (found_ == before && list_.unreadable.empty()) return Error{"no " + noun_ + " in " + path};
    } else if (!fs::exists(status) && path.find_first_of("*?[") != std::string::npos) {
      return AddMatches(path);
    } else {
      AddFile(path);
    }
    return std::nullopt;
  }

  [[nodiscard]] FileList Take() {
    std::sort(list_.files.begin(), list_.files.end());
    return std::move(list_);
  }

 private:
  void AddFolder(const fs::path& folder) {
    std::error_code code;
    fs::directory_iterator entry(folder, code);
    for (; !code && entry != fs::directory_iterator(); entry.increment(code)) {
      const std::string name = entry->path().filename().string();
      std::error_code ignored;
      if (name.starts_with('.')) continue;
      if (entry->is_directory(ignored)) {
        if (!entry->is_symlink(ignored)) AddFolder(entry->path());
      } else if (wanted_(name) && entry->is_regular_file(ignored)) {
        AddFile(entry->path().string());
      }
    }
    if (code)
      list_.unreadable.push_back({folder.string(), "cannot read folder " + folder.string() + ": " + code.message()});
  }

  [[nodiscard]] std::optional<Error> AddMatches(const std::string& pattern) {
    glob_t matches{};
    const int outcome = glob(pattern.c_str(), 0, nullptr, &matches);
    std::optional<Error> error;
    if (outcome != 0) error = Error{"nothing matches " + pattern};
    for (std::size_t i = 0; outcome == 0 && !error && i < matches.gl_pathc; ++i) error = Add(matches.gl_pathv[i]);
    globfree(&matches);
    return error;
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
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// The path without what tells the files of one ring buffer apart.
std::string RingKey(const std::string& path) {
  static const std::regex dumpcap(R"(^(.*)_([0-9]{5,}_[0-9]{14}|[0-9]{14}_[0-9]{5,})(\.[^/]+)$)");
  static const std::regex tcpdump(R"(^(.*\.pcap)[0-9]+((\.gz|\.zst)?)$)");
  std::smatch parts;
  if (std::regex_match(path, parts, dumpcap)) return parts.str(1) + "_*" + parts.str(3);
  if (std::regex_match(path, parts, tcpdump)) return parts.str(1) + parts.str(2);
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
