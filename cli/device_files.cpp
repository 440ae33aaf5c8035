#include "cli/device_files.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "cli/families.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string FileName(const std::string& path) {
  return Printable(std::filesystem::path(path).filename().string());
}

std::optional<Error> AddEsi(const std::string& path, DeviceFiles& files) {
  Result<device::EsiFile> file = device::LoadEsiFile(path);
  if (!file) return file.error();
  if (file->devices.empty()) return Error{Printable(path) + ": describes no device"};
  files.esi.push_back({FileName(path), std::move(*file), path});
  return std::nullopt;
}

/// A vendor's folder holds files of modules, drafts and other XML as well: a file that is not the ESI file of a device
/// is reported and left out.
std::optional<Error> AddFolder(const std::string& folder, DeviceFiles& files, std::vector<std::string>& skipped) {
  const auto names = system::NamesIn(folder);
  if (!names) return Error{Printable(folder) + ": " + system::ReasonText(errno)};
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : *names) {
    const std::filesystem::path path = std::filesystem::path(folder) / name;
    std::string extension = path.extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == ".xml") paths.push_back(path);
  }
  const std::size_t before = files.esi.size();
  for (const std::filesystem::path& path : paths) {
    if (const auto problem = AddEsi(path.string(), files)) skipped.push_back(problem->message);
  }
  if (files.esi.size() > before) return std::nullopt;
  return Error{Printable(folder) + ": none of its " + Count(paths.size(), "XML file") + " describes a device" +
               (skipped.empty() ? "" : "; " + skipped.back())};
}

}  // namespace

Result<std::shared_ptr<const DeviceFiles>> LoadDeviceFiles(const std::vector<std::string>& esi,
                                                           const std::optional<std::string>& eni,
                                                           const std::vector<std::string>& families,
                                                           std::vector<std::string>& skipped) {
  auto files = std::make_shared<DeviceFiles>();
  Result<device::ProfileRegistry> known = LoadFamilies(families);
  if (!known) return known.error();
  files->families = std::move(*known);
  if (esi.empty() && !eni && files->families.own().empty()) return std::shared_ptr<const DeviceFiles>();
  for (const std::string& path : esi) {
    if (system::IsFolder(path)) {
      if (auto problem = AddFolder(path, *files, skipped)) return *problem;
      continue;
    }
    if (auto problem = AddEsi(path, *files)) return *problem;
  }
  if (eni) {
    Result<device::EniConfig> config = device::LoadEniFile(*eni);
    if (!config) return config.error();
    if (config->slaves.empty()) return Error{Printable(*eni) + ": describes no slave"};
    files->eni = {FileName(*eni), std::move(*config)};
  }
  return std::shared_ptr<const DeviceFiles>(std::move(files));
}

}  // namespace ecaudit::cli
