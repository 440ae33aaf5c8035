/// Rows of a manual that have no number to look up by: mailbox, sync managers, PDOs, synchronisation, state machines.
#pragma once

#include <string>
#include <vector>

#include "decoder/device/device_description.h"

namespace ecaudit::cli::lookup {

/// One row: what it is about ("CoE service"), and what the manual states of it ("2 SDO request").
struct RowWithoutNumber {
  std::string title;
  std::string words;
  std::string note;
  std::string source;
};

/// All of them, what the family inherits included, in the order of the profile.
[[nodiscard]] std::vector<RowWithoutNumber> RowsWithoutNumber(const device::DeviceDescription& family);

}  // namespace ecaudit::cli::lookup
