#include "decoder/wire/bridge_frame.h"

#include <algorithm>
#include <array>

#include "decoder/wire/link_header.h"

namespace ecaudit::wire {
namespace {

using GroupAddress = std::array<std::uint8_t, 6>;

constexpr std::size_t kTypeOrLength = 12;  // or the length of an LLC frame
constexpr std::size_t kTagBytes = 4;
constexpr std::uint16_t kLldp = 0x88CC;
constexpr std::uint16_t kLongestLlc = 1500;
constexpr GroupAddress kSpanningTreeGroup{0x01, 0x80, 0xC2, 0x00, 0x00, 0x00};
constexpr GroupAddress kPerVlanGroup{0x01, 0x00, 0x0C, 0xCC, 0xCC, 0xCD};

bool IsToGroup(ByteSpan packet, const GroupAddress& group) {
  return packet.size() >= group.size() && std::equal(group.begin(), group.end(), packet.begin());
}

/// The system capabilities of an LLDP frame: a list of elements with 7 bits of type and 9 bits of length each.
BridgeFrame CapabilitiesOf(ByteSpan packet, std::size_t at) {
  constexpr unsigned kEnd = 0, kCapabilities = 7;
  constexpr std::uint16_t kBridge = 0x0004;
  while (Fits(packet, at, 2)) {
    const auto head = BigEndian<std::uint16_t>(packet, at);
    const unsigned type = head >> 9U;
    const std::size_t length = head & 0x01FFU;
    at += 2;
    if (type == kEnd || !Fits(packet, at, length)) break;
    if (type == kCapabilities && length >= 4) {
      const bool bridges = (BigEndian<std::uint16_t>(packet, at + 2) & kBridge) != 0;
      return bridges ? BridgeFrame::kLldpOfBridge : BridgeFrame::kNone;
    }
    at += length;
  }
  return BridgeFrame::kLldpOfAnyDevice;
}

}  // namespace

BridgeFrame BridgeFrameOf(ByteSpan packet) noexcept {
  // All of these groups begin with 01.
  if (packet.empty() || packet[0] != 0x01) return BridgeFrame::kNone;
  std::size_t payload = kTypeOrLength + 2;
  while (IsVlanTag(BigEndian<std::uint16_t>(packet, payload - 2))) payload += kTagBytes;
  if (!Fits(packet, 0, payload + 3)) return BridgeFrame::kNone;
  const auto type = BigEndian<std::uint16_t>(packet, payload - 2);
  if (type == kLldp) return CapabilitiesOf(packet, payload);
  if (type > kLongestLlc) return BridgeFrame::kNone;
  if (IsToGroup(packet, kPerVlanGroup)) return BridgeFrame::kSpanningTreePerVlan;
  constexpr std::uint8_t kSpanningTreeSap = 0x42;
  const bool spanning_tree = packet[payload] == kSpanningTreeSap && packet[payload + 1] == kSpanningTreeSap;
  return IsToGroup(packet, kSpanningTreeGroup) && spanning_tree ? BridgeFrame::kSpanningTree : BridgeFrame::kNone;
}

}  // namespace ecaudit::wire
