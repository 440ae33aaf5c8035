/// Fields of pcapng blocks in the byte order of their section.
///
///   block: | type 4 | total length 4 | body, padded to 4 | total length 4 |
///   option in a body: | code 2 | length 2 | value, padded to 4 |
#pragma once

#include <cstdint>
#include <optional>

#include "decoder/base/bytes.h"
#include "decoder/capture/byte_order.h"

namespace ecaudit::capture::pcapng {

inline constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A;  // the same in both byte orders
inline constexpr std::uint32_t kInterfaceDescription = 1;
inline constexpr std::uint32_t kObsoletePacket = 2;
inline constexpr std::uint32_t kSimplePacket = 3;
inline constexpr std::uint32_t kInterfaceStatistics = 5;
inline constexpr std::uint32_t kEnhancedPacket = 6;

/// Blocks that hold no packet, yet that Wireshark lists as a frame with a number of its own (found out with
/// tshark 4.0): systemd journal entries, sysdig events, custom blocks.
[[nodiscard]] constexpr bool IsNumberedRecord(std::uint32_t type) {
  switch (type) {
    case 0x00000009:  // systemd journal export
    case 0x00000204:  // sysdig event, version 1
    case 0x00000216:  // version 2
    case 0x00000221:  // version 2, large
    case 0x00000BAD:  // custom, may be copied
    case 0x40000BAD:  // custom, not to be copied
      return true;
    default:
      return false;
  }
}

/// Blocks of other types that are known to hold no packet.
[[nodiscard]] constexpr bool HoldsNoPacket(std::uint32_t type) {
  constexpr std::uint32_t kNameResolution = 4;
  constexpr std::uint32_t kDecryptionSecrets = 10;
  return type == kNameResolution || type == kDecryptionSecrets;
}

/// Link-layer errors in epb_flags that make the bytes of a packet doubtful: wrong symbol, preamble, start of frame,
/// unaligned frame, wrong frame check sequence. Gaps and lengths of the frame do not.
inline constexpr std::uint32_t kDamagedOnWire = 0xF1000000;

/// In epb_flags: bytes of the frame check sequence at the end of the packet; 0: not stated.
[[nodiscard]] constexpr std::uint32_t FcsBytesOf(std::uint32_t flags) {
  return flags >> 5U & 0xFU;
}
[[nodiscard]] constexpr std::uint32_t FcsFlags(std::uint32_t bytes) {
  return bytes << 5U;
}

inline constexpr std::uint32_t kByteOrderMagic = 0x1A2B3C4D;
inline constexpr std::size_t kBlockHeaderBytes = 8;
inline constexpr std::size_t kTrailerBytes = 4;
inline constexpr std::size_t kMinBlockBytes = kBlockHeaderBytes + kTrailerBytes;
/// No tool writes blocks anywhere near this; a larger length field is a broken one.
inline constexpr std::uint32_t kMaxBlockBytes = 64U * 1024U * 1024U;
/// Likewise of blocks that are read, which have to be in memory at once.
inline constexpr std::uint32_t kMaxReadBlockBytes = 16U * 1024U * 1024U;

inline constexpr std::uint16_t kOptEnd = 0;
inline constexpr std::uint16_t kOptComment = 1;
inline constexpr std::uint16_t kIfName = 2;
inline constexpr std::uint16_t kIfTsResol = 9;
inline constexpr std::uint16_t kIfFcsLength = 13;
inline constexpr std::uint16_t kIfTsOffset = 14;
inline constexpr std::uint16_t kPacketFlags = 2;  // epb_flags and pack_flags
inline constexpr std::uint16_t kEpbDropCount = 4;
inline constexpr std::uint16_t kIsbIfDrop = 5;
inline constexpr std::uint16_t kIsbOsDrop = 7;

/// Lengths in pcapng count without padding, data lie padded to four bytes.
[[nodiscard]] constexpr std::size_t Padded(std::size_t length) {
  return (length + 3) & ~std::size_t{3};
}

struct Option {
  std::uint16_t code = 0;
  ByteSpan value;
};

/// Walks over the options at the end of a block's body.
class OptionReader {
 public:
  OptionReader(ByteSpan options, ByteOrder order) : rest_(options), order_(order) {}

  /// The next option; empty at the end, and at an option that reaches past the end, which makes broken() true.
  std::optional<Option> Next() {
    if (rest_.empty()) return std::nullopt;
    if (rest_.size() < kHeaderBytes) return Broken();
    const Option option{order_.U16(rest_, 0), Slice(rest_, kHeaderBytes, order_.U16(rest_, 2))};
    if (option.code == kOptEnd) return std::nullopt;
    if (option.value.size() != order_.U16(rest_, 2)) return Broken();
    rest_ = Slice(rest_, kHeaderBytes + Padded(option.value.size()));
    return option;
  }
  [[nodiscard]] bool broken() const { return broken_; }

 private:
  static constexpr std::size_t kHeaderBytes = 4;

  std::nullopt_t Broken() {
    broken_ = true;
    rest_ = {};
    return std::nullopt;
  }

  ByteSpan rest_;
  ByteOrder order_;
  bool broken_ = false;
};

}  // namespace ecaudit::capture::pcapng
