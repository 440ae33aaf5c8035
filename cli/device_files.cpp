#include "cli/device_files.h"

#include <filesystem>
#include <utility>

#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string FileName(const std::string& path) {
  return Printable(std::filesystem::path(path).filename().string());
}

}  // namespace

Result<std::shared_ptr<const DeviceFiles>> LoadDeviceFiles(const std::vector<std::string>& esi,
                                                           const std::optional<std::string>& eni) {
  if (esi.empty() && !eni) return std::shared_ptr<const DeviceFiles>();
  auto files = std::make_shared<DeviceFiles>();
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
