#include "decoder/capture/ethercat_traces.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace ecaudit::capture {
namespace {

/// Link types that captures of industrial networks come with; numbers and names as in the list of tcpdump.org.
constexpr std::array<std::pair<std::uint16_t, std::string_view>, 20> kLinkTypes{{{0, "BSD loopback"},
                                                                                 {1, "Ethernet"},
                                                                                 {12, "raw IP"},
                                                                                 {101, "raw IP"},
                                                                                 {105, "IEEE 802.11"},
                                                                                 {113, "Linux cooked capture"},
                                                                                 {127, "radiotap"},
                                                                                 {147, "user 0"},
                                                                                 {148, "user 1"},
                                                                                 {149, "user 2"},
                                                                                 {150, "user 3"},
                                                                                 {189, "USB"},
                                                                                 {192, "per-packet information"},
                                                                                 {220, "USB"},
                                                                                 {228, "IPv4"},
                                                                                 {229, "IPv6"},
                                                                                 {240, "netANALYZER"},
                                                                                 {241, "netANALYZER, transparent"},
                                                                                 {249, "USBPcap"},
                                                                                 {276, "Linux cooked capture 2"}}};

constexpr std::size_t kFirstBytes = 128;
constexpr std::size_t kTypeAndHeaders = 2 + 2 + 10;  // EtherType, EtherCAT header, datagram header
constexpr unsigned kLastCommand = 14;

}  // namespace

bool HoldsEtherCat(ByteSpan bytes) {
  const ByteSpan head = Slice(bytes, 0, std::min(bytes.size(), kFirstBytes));
  for (std::size_t at = 0; at + kTypeAndHeaders <= head.size(); ++at) {
    if (head[at] != 0x88 || head[at + 1] != 0xA4) continue;
    const auto header = LittleEndian<std::uint16_t>(head, at + 2);
    const auto length = LittleEndian<std::uint16_t>(head, at + 10) & 0x07FFU;
    const bool commands = header >> 12U == 1 && head[at + 4] <= kLastCommand;
    if (commands && length + 12 <= (header & 0x07FFU)) return true;
  }
  return false;
}

std::string LinkTypeText(std::uint16_t link_type) {
  std::string text = "link type " + std::to_string(link_type);
  for (const auto& [number, name] : kLinkTypes) {
    if (number == link_type) text.append(" (").append(name).append(")");
  }
  return text;
}

}  // namespace ecaudit::capture
