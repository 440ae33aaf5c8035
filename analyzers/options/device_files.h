/// What the user's files state about the devices on the bus (--esi, --eni, --profiles). Read once, shared by all
/// analyses of a run.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "decoder/device/eni_reader.h"
#include "decoder/device/esi_reader.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit {

struct DeviceFiles {
  struct Esi {
    std::string name;  ///< of the file, without folders, for people
    device::EsiFile content;
    std::string path;
  };
  struct Eni {
    std::string name;
    device::EniConfig content;
  };

  std::vector<Esi> esi;  ///< in the order of the command line
  std::optional<Eni> eni;
  device::ProfileRegistry families;  ///< the built-in ones and those that were added
};

}  // namespace ecaudit
