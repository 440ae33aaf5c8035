/// Reads EtherCAT slave information files (ESI, ETG.2000) into device descriptions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/result.h"
#include "decoder/device/device_description.h"

namespace ecaudit::device {

struct EsiFile {
  std::uint32_t vendor_id = 0;
  std::string vendor_name;
  /// In the order of the file. Filled: title, match, esi, pdo (contents and assignable ones), dictionary, mailbox
  /// (sync managers, protocols). Their AL table is empty: an ESI does not state which transitions a device allows.
  std::vector<DeviceDescription> devices;

  /// The device with that product code: of that revision, else the one with the highest revision. Null when absent.
  [[nodiscard]] const DeviceDescription* Find(std::uint32_t product_code, std::uint32_t revision) const;
};

/// Fails with "line 12, column 5: reason". Document type declarations, and with them entities, are refused.
[[nodiscard]] Result<EsiFile> ReadEsi(std::string_view xml);
/// Same for a file; errors begin with its path.
[[nodiscard]] Result<EsiFile> LoadEsiFile(const std::string& path);

/// `family` with what the ESI states about the single device: identity, PDOs, objects, sync managers, mailbox
/// protocols, DC modes. What only the family knows (state machines, limits, emergency codes) stays.
[[nodiscard]] DeviceDescription WithEsi(DeviceDescription family, const DeviceDescription& esi);

}  // namespace ecaudit::device
