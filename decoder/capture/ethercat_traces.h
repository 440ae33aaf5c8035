/// Whether bytes that nobody knows how to read may be an EtherCAT frame, and how link types are called.
#pragma once

#include <cstdint>
#include <string>

#include "decoder/base/bytes.h"

namespace ecaudit::capture {

/// True when an EtherCAT header stands behind its EtherType somewhere in the first bytes: what an unknown link type or
/// block has in front of an Ethernet frame is short.
[[nodiscard]] bool HoldsEtherCat(ByteSpan bytes);

/// "link type 240 (netANALYZER)"
[[nodiscard]] std::string LinkTypeText(std::uint16_t link_type);

}  // namespace ecaudit::capture
