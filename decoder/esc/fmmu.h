/// One FMMU (maps logical to ESC memory): 16 bytes at 0x0600 + 16 * n (esc-reference 4.8, 7).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"

namespace ecaudit::esc {

inline constexpr EscAddress kFmmuBase = 0x0600;
inline constexpr std::size_t kFmmuBytes = 16;
inline constexpr std::size_t kMaxFmmus = 16;

/// Address of FMMU `n`, 0-15.
[[nodiscard]] constexpr EscAddress FmmuAddress(std::size_t n) {
  return static_cast<EscAddress>(kFmmuBase + n * kFmmuBytes);
}

/// A run of bits, counted from bit 0 of byte 0 of the logical or of the ESC address space.
struct BitRange {
  std::uint64_t first = 0;
  std::uint64_t count = 0;

  [[nodiscard]] constexpr std::uint64_t end() const { return first + count; }
  [[nodiscard]] constexpr bool empty() const { return count == 0; }
  friend constexpr bool operator==(const BitRange&, const BitRange&) = default;
};

/// The bits both ranges have; empty (count 0) when there are none.
[[nodiscard]] constexpr BitRange Intersect(const BitRange& a, const BitRange& b) {
  const std::uint64_t first = std::max(a.first, b.first);
  const std::uint64_t end = std::min(a.end(), b.end());
  return end > first ? BitRange{first, end - first} : BitRange{};
}

struct Fmmu {
  std::uint32_t logical_start = 0;      ///< byte address
  std::uint16_t length = 0;             ///< logical bytes touched
  std::uint8_t logical_start_bit = 0;   ///< 0-7, in the first byte
  std::uint8_t logical_stop_bit = 0;    ///< 0-7, in the last byte, included
  std::uint16_t physical_start = 0;     ///< byte address in ESC memory
  std::uint8_t physical_start_bit = 0;  ///< 0-7
  std::uint8_t type = 0;                ///< bit 0 read, bit 1 write; not the function code of the SII
  std::uint8_t activate = 0;

  /// @param bytes at least the 13 bytes up to Activate, else nothing; the reserved bytes after are ignored
  [[nodiscard]] static constexpr std::optional<Fmmu> Decode(ByteSpan bytes) {
    if (bytes.size() < 13) return std::nullopt;
    return Fmmu{LittleEndian<std::uint32_t>(bytes, 0),
                LittleEndian<std::uint16_t>(bytes, 4),
                static_cast<std::uint8_t>(bytes[6] & 0x07U),
                static_cast<std::uint8_t>(bytes[7] & 0x07U),
                LittleEndian<std::uint16_t>(bytes, 8),
                static_cast<std::uint8_t>(bytes[10] & 0x07U),
                bytes[11],
                bytes[12]};
  }

  [[nodiscard]] constexpr bool reads() const { return (type & 0x01U) != 0; }   ///< inputs: answers LRD and LRW
  [[nodiscard]] constexpr bool writes() const { return (type & 0x02U) != 0; }  ///< outputs: takes LWR and LRW
  [[nodiscard]] constexpr bool active() const { return (activate & 0x01U) != 0; }
  /// Start bit 0, stop bit 7, physical bit 0: a plain copy of `length` bytes.
  [[nodiscard]] constexpr bool byte_aligned() const {
    return logical_start_bit == 0 && logical_stop_bit == 7 && physical_start_bit == 0;
  }

  /// Mapped bits: (length - 1) * 8 + stop - start + 1; 0 when the length is 0 or the stop bit lies before the start bit
  /// of the only byte.
  [[nodiscard]] constexpr std::uint32_t bit_count() const {
    const std::int64_t bits = (std::int64_t{length} - 1) * 8 + logical_stop_bit - logical_start_bit + 1;
    return length == 0 || bits <= 0 ? 0 : static_cast<std::uint32_t>(bits);
  }
  /// The mapped bits in the logical address space. It does not wrap at 2^32 bytes: no ESC is known to.
  [[nodiscard]] constexpr BitRange logical_bits() const {
    return {std::uint64_t{logical_start} * 8 + logical_start_bit, bit_count()};
  }
  /// The mapped bits in ESC memory; may reach past 0xFFFF for a senseless setting.
  [[nodiscard]] constexpr BitRange physical_bits() const {
    return {std::uint64_t{physical_start} * 8 + physical_start_bit, bit_count()};
  }
  /// First ESC address after the mapped bits; physical_start when nothing is mapped.
  [[nodiscard]] constexpr std::uint32_t physical_end() const {
    return bit_count() == 0 ? physical_start : static_cast<std::uint32_t>((physical_bits().end() + 7) / 8);
  }

  /// The logical bits that an access to [logical, logical + bytes) shares with this FMMU; empty when none. Neither
  /// activation nor type is considered.
  [[nodiscard]] constexpr BitRange Overlap(std::uint32_t logical, std::size_t bytes) const {
    return Intersect(logical_bits(), {std::uint64_t{logical} * 8, std::uint64_t{bytes} * 8});
  }
  /// ESC memory bit (address * 8 + bit) after a logical bit (address * 8 + bit).
  [[nodiscard]] constexpr std::optional<std::uint64_t> ToPhysicalBit(std::uint64_t logical_bit) const {
    return Map(logical_bit, logical_bits(), physical_bits());
  }
  /// The other way round.
  [[nodiscard]] constexpr std::optional<std::uint64_t> ToLogicalBit(std::uint64_t physical_bit) const {
    return Map(physical_bit, physical_bits(), logical_bits());
  }

  friend constexpr bool operator==(const Fmmu&, const Fmmu&) = default;

 private:
  [[nodiscard]] static constexpr std::optional<std::uint64_t> Map(std::uint64_t bit, const BitRange& from,
                                                                  const BitRange& to) {
    if (bit < from.first || bit >= from.end()) return std::nullopt;
    return to.first + (bit - from.first);
  }
};

}  // namespace ecaudit::esc
