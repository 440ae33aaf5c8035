/// Rows of a manual that have no number to look up by: mailbox, sync managers, PDOs, synchronisation, state machines.
#pragma once

#include <string>
#include <vector>

#include "decoder/device/device_description.h"

namespace ecaudit::cli::lookup {

/// One row in words: "CoE service 2: SDO request".
struct ManualRow {
  std::string text;
  std::string note;
  std::string source;
};

/// All of them, what the family inherits included, in the order of the profile.
[[nodiscard]] std::vector<ManualRow> ManualRows(const device::DeviceDescription& family);

}  // namespace ecaudit::cli::lookup
