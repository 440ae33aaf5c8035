/// Packets byte by byte, so that the tests of FrameView share no code with the frame builder.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <vector>

#include "decoder/wire/frame_view.h"

namespace ecaudit::wire::test {

using Bytes = std::vector<std::uint8_t>;

inline void Append(Bytes& to, const Bytes& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Header, `data` and working counter (esc-reference 1.3). `flags`: bits 15:11 of the length word (0x8000 more,
/// 0x4000 circulating, 0x3800 reserved).
struct DatagramBytes {
  std::uint8_t command = 4;
  std::uint8_t index = 0;
  std::uint16_t adp = 0x1001;
  std::uint16_t ado = 0x0130;
  Bytes data = {0, 0};
  std::uint16_t wkc = 0;
  std::uint16_t irq = 0;
  std::uint16_t flags = 0;

  [[nodiscard]] Bytes Encode() const {
    const auto length = static_cast<std::uint16_t>(data.size() | flags);
    const auto low = [](std::uint16_t v) { return static_cast<std::uint8_t>(v & 0xFFU); };
    const auto high = [](std::uint16_t v) { return static_cast<std::uint8_t>(v >> 8U); };
    Bytes out{command, index, low(adp), high(adp), low(ado), high(ado), low(length), high(length), low(irq), high(irq)};
    Append(out, data);
    out.push_back(low(wkc));
    out.push_back(high(wkc));
    return out;
  }
};

/// Datagrams one behind the other, the more flag set on all but the last.
inline Bytes Datagrams(std::vector<DatagramBytes> datagrams) {
  Bytes out;
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    if (i + 1 < datagrams.size()) datagrams[i].flags |= 0x8000U;
    Append(out, datagrams[i].Encode());
  }
  return out;
}

/// The two bytes before the datagrams: length in bits 10:0, type in 15:12 (esc-reference 1.2).
inline Bytes Header(std::size_t length, std::uint8_t type = 1) {
  const auto word = static_cast<std::uint16_t>((length & 0x07FFU) | static_cast<std::uint16_t>(type << 12U));
  return {static_cast<std::uint8_t>(word & 0xFFU), static_cast<std::uint8_t>(word >> 8U)};
}

/// EtherCAT header and `datagrams` with the right length.
inline Bytes Payload(const Bytes& datagrams, std::uint8_t type = 1) {
  Bytes out = Header(datagrams.size(), type);
  Append(out, datagrams);
  return out;
}

/// Destination ff:.., source 02:11:22:33:44:55 unless given, then `ethertypes` (EtherType, or tags with their TCI).
inline Bytes Ethernet(const Bytes& behind_addresses, const Bytes& rest,
                      const Bytes& source = {0x02, 0x11, 0x22, 0x33, 0x44, 0x55}) {
  Bytes out(6, 0xFF);
  Append(out, source);
  Append(out, behind_addresses);
  Append(out, rest);
  return out;
}

inline const Bytes kEtherCatType{0x88, 0xA4};

/// Plain Ethernet II frame around `payload` (header included).
inline Bytes Plain(const Bytes& payload) {
  return Ethernet(kEtherCatType, payload);
}

inline capture::CapturedFrame Captured(const Bytes& bytes, std::uint16_t link_type = 1,
                                       std::uint32_t original_length = 0) {
  capture::CapturedFrame frame;
  frame.number = 7;
  frame.time = 123;
  frame.has_time = true;
  frame.link_type = link_type;
  frame.bytes = bytes;
  frame.original_length = original_length == 0 ? static_cast<std::uint32_t>(bytes.size()) : original_length;
  return frame;
}

/// `bytes` must outlive the view.
inline FrameView Parse(const Bytes& bytes, std::uint16_t link_type = 1, std::uint32_t original_length = 0) {
  const capture::CapturedFrame frame = Captured(bytes, link_type, original_length);
  return FrameView::Parse(frame);
}
FrameView Parse(Bytes&&, std::uint16_t = 1, std::uint32_t = 0) = delete;

}  // namespace ecaudit::wire::test
