#include "cli/device_files.h"

#include <filesystem>
#include <utility>

#include "cli/families.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string FileName(const std::string& path) {
  return Printable(std::filesystem::path(path).filename().string());
}

}  // namespace

Result<std::shared_ptr<const DeviceFiles>> LoadDeviceFiles(const std::vector<std::string>& esi,
                                                           const std::optional<std::string>& eni,
                                                           const std::vector<std::string>& families) {
  auto files = std::make_shared<DeviceFiles>();
  Result<device::ProfileRegistry> known = LoadFamilies(families);
  if (!known) return known.error();
  files->families = std::move(*known);
  if (esi.empty() && !eni && files->families.own().empty()) return std::shared_ptr<const DeviceFiles>();
  for (const std::string& path : esi) {
    Result<device::EsiFile> file = device::LoadEsiFile(path);
    if (!file) return file.error();
    if (file->devices.empty()) return Error{Printable(path) + ": describes no device"};
    files->esi.push_back({FileName(path), std::move(*file)});
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
