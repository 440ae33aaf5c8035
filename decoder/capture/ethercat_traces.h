/// Whether unreadable bytes may be an EtherCAT frame, and the names of link types.
#pragma once

#include <cstdint>
#include <string>

#include "decoder/base/bytes.h"

namespace ecaudit::capture {

/// True when an EtherCAT header follows its EtherType somewhere in the first bytes: what an unknown link type or
/// block has in front of an Ethernet frame is short.
[[nodiscard]] bool HoldsEtherCat(ByteSpan bytes);

/// "link type 240 (netANALYZER)"
[[nodiscard]] std::string LinkTypeText(std::uint16_t link_type);

}  // namespace ecaudit::capture
