/// Vendor specific protocol over EtherCAT.
///
///   | vendor id 4 | vendor's type 2 | data |
///
/// Source: ETG.1000.6 VoE; esc-reference 8.7 (layout not confirmed by a second source).
#pragma once

#include <cstdint>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

struct VoeHeader {
  std::uint32_t vendor_id = 0;
  std::uint16_t vendor_type = 0;
  ByteSpan data;
  bool too_short = false;  ///< what is missing reads as 0
};

[[nodiscard]] constexpr VoeHeader ParseVoe(ByteSpan payload) {
  return {LittleEndian<std::uint32_t>(payload, 0), LittleEndian<std::uint16_t>(payload, 4), Slice(payload, 6),
          payload.size() < 6};
}

}  // namespace ecaudit::mailbox
