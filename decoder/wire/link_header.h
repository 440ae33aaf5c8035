/// Where the fields of the headers below EtherCAT lie: the one place that knows them. Another link type is a number in
/// capture::LinkType and a case here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "decoder/capture/frame_source.h"

namespace ecaudit::wire {

/// 802.1Q, 802.1ad and the older number of the latter: a tag of 4 bytes, then another type.
[[nodiscard]] constexpr bool IsVlanTag(std::uint16_t ethertype) {
  return ethertype == 0x8100 || ethertype == 0x88A8 || ethertype == 0x9100;
}

/// Offsets in the packet. A record of a probe before an Ethernet header is not counted.
struct LinkHeader {
  std::optional<std::size_t> destination;  ///< MAC address of the receiver
  std::size_t source = 0;                  ///< MAC address of the sender
  std::size_t type = 0;                    ///< EtherType, of the payload or of the first VLAN tag
  std::size_t payload = 0;                 ///< or what follows the first EtherType of VLAN tags
  /// Packet type of Linux, big-endian: 4 if the recording machine sent the packet.
  std::size_t packet_type = 0;
  std::size_t packet_type_bytes = 0;  ///< 0: the header has none
};

/// @param link_type  a capture::LinkType; nothing for all others, which carry no EtherCAT
[[nodiscard]] constexpr std::optional<LinkHeader> LinkHeaderOf(std::uint16_t link_type) {
  switch (static_cast<capture::LinkType>(link_type)) {
    case capture::LinkType::kEthernet:
    case capture::LinkType::kNetAnalyzer:  // its record before the frame is not counted
    case capture::LinkType::kNetAnalyzerTransparent:
      return LinkHeader{.destination = 0, .source = 6, .type = 12, .payload = 14};
    case capture::LinkType::kLinuxCooked:
      // packet type 2, ARPHRD 2, address length 2, address 8, protocol 2
      return LinkHeader{
          .destination = {}, .source = 6, .type = 14, .payload = 16, .packet_type = 0, .packet_type_bytes = 2};
    case capture::LinkType::kLinuxCooked2:
      // protocol 2, reserved 2, interface 4, ARPHRD 2, packet type 1, address length 1, address 8
      return LinkHeader{
          .destination = {}, .source = 12, .type = 0, .payload = 20, .packet_type = 10, .packet_type_bytes = 1};
  }
  return std::nullopt;
}

}  // namespace ecaudit::wire
