/// in: a packet that is no EtherCAT.  out: whether a switch sent it.
///
/// Source: IEEE 802.1D, 802.1Q (spanning tree), 802.1AB (LLDP). Only bridges send spanning tree; LLDP is sent by many
/// devices, and its system capabilities show which of them bridges.
#pragma once

#include <cstdint>

#include "decoder/base/bytes.h"

namespace ecaudit::wire {

enum class BridgeFrame : std::uint8_t {
  kNone,
  kSpanningTree,         ///< STP, RSTP, MSTP
  kSpanningTreePerVlan,  ///< the same of one VLAN, to the group address 01:00:0C:CC:CC:CD
  kLldpOfBridge,         ///< LLDP of a device that bridges
  kLldpOfAnyDevice,      ///< LLDP that does not show whether its sender bridges
};

/// @param packet  begins with the destination MAC
[[nodiscard]] BridgeFrame BridgeFrameOf(ByteSpan packet) noexcept;

}  // namespace ecaudit::wire
