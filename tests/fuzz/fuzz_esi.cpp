/// Fuzzes the reader of ESI files, and laying its devices over each other.
///
/// Input: the XML text.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "decoder/device/esi_reader.h"

namespace {

void Check(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit::device;
  const auto file = ReadEsi(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!file) {
    Check(!file.error().message.empty());
    return 0;
  }
  for (const DeviceDescription& device : file->devices) {
    Check(device.match.vendor_id == file->vendor_id);
    const DeviceDescription merged = WithEsi(file->devices.front(), device);
    for (const PdoContent& pdo : device.pdo.fixed) {
      const PdoContent* found = merged.pdo.FindFixed(pdo.index);
      Check(found != nullptr && found->index == pdo.index);
    }
    if (!device.dictionary) continue;
    for (const DictionaryObject& object : device.dictionary->objects) {
      Check(object.head ? merged.dictionary->FindIndex(object.index) != nullptr
                        : merged.dictionary->Find(object.index, object.subindex) != nullptr);
    }
  }
  return 0;
}
