/// Checked access to untrusted bytes. All multi-byte fields of EtherCAT are little endian, those of Ethernet big
/// endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace ecaudit {

using ByteSpan = std::span<const std::uint8_t>;

/// True when `length` bytes from `offset` lie inside `bytes`; safe against overflow.
[[nodiscard]] constexpr bool Fits(ByteSpan bytes, std::size_t offset, std::size_t length) {
  return offset <= bytes.size() && length <= bytes.size() - offset;
}

/// Little-endian unsigned integer at `offset`; 0 when it does not fit (check with Fits() where that matters).
template <typename T>
[[nodiscard]] constexpr T LittleEndian(ByteSpan bytes, std::size_t offset) {
  static_assert(std::is_unsigned_v<T>);
  if (!Fits(bytes, offset, sizeof(T))) return 0;
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<T>(value | static_cast<T>(static_cast<T>(bytes[offset + i]) << (8 * i)));
  }
  return value;
}

/// All of `bytes` as one little-endian unsigned integer; of more than eight, the first eight.
[[nodiscard]] constexpr std::uint64_t UnsignedOf(ByteSpan bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 8; ++i) value |= std::uint64_t{bytes[i]} << (8 * i);
  return value;
}

/// The lowest `bits` of `raw` as two's complement; all 64 where `bits` is 0 or at least 64.
[[nodiscard]] constexpr std::int64_t SignExtend(std::uint64_t raw, unsigned bits) {
  if (bits == 0 || bits >= 64) return static_cast<std::int64_t>(raw);
  const unsigned unused = 64 - bits;
  return static_cast<std::int64_t>(raw << unused) >> unused;
}

/// Big-endian unsigned integer at `offset`; 0 when it does not fit.
template <typename T>
[[nodiscard]] constexpr T BigEndian(ByteSpan bytes, std::size_t offset) {
  static_assert(std::is_unsigned_v<T>);
  if (!Fits(bytes, offset, sizeof(T))) return 0;
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<T>(static_cast<T>(value << (sizeof(T) > 1 ? 8 : 0)) | bytes[offset + i]);
  }
  return value;
}

/// The part of `bytes` from `offset` on, at most `length` bytes; empty when `offset` lies behind the end.
[[nodiscard]] constexpr ByteSpan Slice(ByteSpan bytes, std::size_t offset,
                                       std::size_t length = static_cast<std::size_t>(-1)) {
  if (offset >= bytes.size()) return {};
  const std::size_t rest = bytes.size() - offset;
  return bytes.subspan(offset, length < rest ? length : rest);
}

}  // namespace ecaudit
