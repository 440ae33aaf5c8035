#include "cli/wireshark/plugin_files.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <QResource>
#include <QString>

#include "cli/output_file.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/program.h"

// A static library does not register its resources by itself. The macro has to stand outside of all namespaces.
static void RegisterPlugin() {
  Q_INIT_RESOURCE(wireshark);
}

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFieldsFile = "ecaudit-signals.txt";
constexpr std::string_view kCapturesFile = "ecaudit-captures.txt";
constexpr std::size_t kMostFields = 8192;
constexpr std::size_t kMostCaptures = 1000;
constexpr std::size_t kLongestList = std::size_t{4} << 20U;

std::string_view Embedded(const char* name) {
  RegisterPlugin();
  const QResource file(QStringLiteral(":/ecaudit/wireshark/") + QString::fromUtf8(name));
  if (!file.isValid() || file.compressionAlgorithm() != QResource::NoCompression) return {};
  return {reinterpret_cast<const char*>(file.data()), static_cast<std::size_t>(file.size())};
}

/// Wireshark's folder of settings.
fs::path SettingsFolder(const fs::path& home) {
  if (const std::string given = system::Environment("WIRESHARK_CONFIG_DIR"); !given.empty()) return given;
  const std::string configured = system::Environment("XDG_CONFIG_HOME");
  const fs::path folder = (configured.empty() ? home / ".config" : fs::path(configured)) / "wireshark";
  const fs::path old = home / ".wireshark";
  return !system::Exists(folder.string()) && system::Exists(old.string()) ? old : folder;
}

/// Empty where there is none.
std::string Content(const fs::path& path) {
  if (const auto status = system::StatusOf(path.string()); !status || status->bytes > kLongestList) return {};
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<std::string> Lines(const fs::path& path) {
  const std::string text = Content(path);
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (end > at) lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

std::optional<Error> WriteLines(const fs::path& path, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text.append(line).push_back('\n');
  return WriteOutputFile(path.string(), text);
}

std::optional<Error> MakeFolder(const std::string& folder) {
  if (system::MakeFolders(folder)) return std::nullopt;
  return Error{"cannot make the folder " + folder + ": " + system::ReasonText(errno)};
}

}  // namespace

Result<PluginFiles> PluginFiles::In(const std::string& folder) {
  PluginFiles files;
  if (!folder.empty()) {
    files.folder_ = folder;
    return files;
  }
  if (const std::string roaming = system::Environment("APPDATA"); !roaming.empty()) {  // Windows
    const fs::path settings = fs::path(roaming) / "Wireshark";
    files.folder_ = (settings / "plugins").string();
    files.profile_ = (settings / "profiles" / "ecaudit").string();
    return files;
  }
  const fs::path home = system::Environment("HOME");
  if (home.empty()) return Error{"HOME is not set; name the folder of the plugin with --folder"};
  files.folder_ = (home / ".local" / "lib" / "wireshark" / "plugins").string();
  files.profile_ = (SettingsFolder(home) / "profiles" / "ecaudit").string();
  return files;
}

std::string PluginFiles::plugin() const {
  return (fs::path(folder_) / kPluginFile).string();
}

bool PluginFiles::installed() const {
  return system::IsFile(plugin());
}

bool PluginFiles::differs() const {
  return installed() && Content(plugin()) != Embedded("ecaudit.lua");
}

std::optional<Error> PluginFiles::Install() const {
  if (auto error = MakeFolder(folder_)) return error;
  if (auto error = WriteOutputFile(plugin(), Embedded("ecaudit.lua"))) return error;
  if (profile_.empty()) return std::nullopt;
  if (auto error = MakeFolder(profile_)) return error;
  for (const char* name : {"preferences", "colorfilters"}) {
    const fs::path path = fs::path(profile_) / name;
    if (system::Exists(path.string())) continue;
    if (auto error = WriteOutputFile(path.string(), Embedded(name))) return error;
  }
  return std::nullopt;
}

Result<std::size_t> PluginFiles::AddFields(const std::vector<SignalField>& fields) const {
  const fs::path path = fs::path(folder_) / kFieldsFile;
  std::vector<std::string> lines = Lines(path);
  std::set<std::string> known;
  for (const std::string& line : lines) known.insert(line.substr(0, line.find('\t')));
  std::size_t added = 0;
  for (const SignalField& field : fields) {
    if (lines.size() >= kMostFields) break;
    if (!known.insert(field.key).second) continue;
    lines.push_back(field.key + '\t' + field.type + '\t' + field.title);
    ++added;
  }
  if (added > 0) {
    if (auto error = WriteLines(path, lines)) return *error;
  }
  return added;
}

std::optional<Error> PluginFiles::AddCapture(const FirstFrame& first, const std::string& side_file) const {
  const fs::path path = fs::path(folder_) / kCapturesFile;
  std::vector<std::string> lines = Lines(path);
  std::erase_if(lines, [&](const std::string& line) { return line.ends_with('\t' + side_file); });
  lines.insert(lines.begin(), first.time + '\t' + std::to_string(first.length) + '\t' + side_file);
  if (lines.size() > kMostCaptures) lines.resize(kMostCaptures);
  return WriteLines(path, lines);
}

}  // namespace ecaudit::cli
