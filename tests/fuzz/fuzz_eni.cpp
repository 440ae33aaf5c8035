/// Fuzzes the reader of ENI files.
///
/// Input: the XML text.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "decoder/device/eni_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit::device;
  const auto config = ReadEni(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!config) {
    if (config.error().message.empty()) std::abort();
    return 0;
  }
  for (const EniSlave& slave : config->slaves) {
    if (slave.station_address && config->FindByAddress(*slave.station_address) == nullptr) std::abort();
    if (slave.position() && config->FindByPosition(*slave.position()) == nullptr) std::abort();
    for (const EniInitCommand& command : slave.init_commands) {
      if (static_cast<unsigned>(command.command) > 14) std::abort();
    }
  }
  return 0;
}
