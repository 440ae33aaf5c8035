/// Names of the bits of the AL event registers, in the words of a family's manual.
#pragma once

#include <string>

#include "decoder/base/ids.h"
#include "decoder/device/device_description.h"

namespace ecaudit::device {

/// "Sync0 DC Event"; in the words of the register map where the family gives the bit no name of its own, or describes
/// several bits in one row.
/// @param address 0x0204 (AL event mask) or 0x0220 (AL event request); names of the ECAT events 0x0200 and 0x0210 are
/// the
///        register map's, no manual of a family has any
/// @param bit 0-31, from the first bit of the register
[[nodiscard]] std::string EventBitName(const DeviceDescription& family, EscAddress address, unsigned bit);

}  // namespace ecaudit::device
