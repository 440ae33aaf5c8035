/// `profiles --new`: the beginning of a family's file.
#pragma once

#include <string>

#include "decoder/device/device_description.h"

namespace ecaudit::cli {

struct ProfileBeginning {
  std::string id;
  std::string extends = "generic";
  const device::DeviceDescription* esi = nullptr;  ///< device of an ESI file; null: nothing is known yet
  std::string esi_file;                            ///< its name, for the citations
};

/// A file that `profiles --check` finds nothing wrong with: what the ESI states, with its citations, and where it
/// states nothing a note of what a manual would have to state.
[[nodiscard]] std::string ProfileBeginningText(const ProfileBeginning& wish);

}  // namespace ecaudit::cli
