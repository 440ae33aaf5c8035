/// Checked access to untrusted bytes. All multi-byte fields of EtherCAT are little endian, those of Ethernet big
/// endian.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace ecaudit {

using ByteSpan = std::span<const std::uint8_t>;

/// True when `length` bytes from `offset` lie inside `bytes`; safe against overflow.
[[nodiscard]] constexpr bool Fits(ByteSpan bytes, std::size_t offset, std::size_t length) {
  return offset <= bytes.size() && length <= bytes.size() - offset;
}

/// The bytes of an unsigned integer in the opposite order.
template <typename T>
[[nodiscard]] constexpr T SwapBytes(T value) {
  static_assert(std::is_unsigned_v<T>);
  if constexpr (sizeof(T) == 2) return __builtin_bswap16(value);
  if constexpr (sizeof(T) == 4) return __builtin_bswap32(value);
  if constexpr (sizeof(T) == 8) return __builtin_bswap64(value);
  return value;
}

/// Little-endian unsigned integer at `at`, where sizeof(T) bytes are known to be. One load: compilers do not see that
/// in a loop over bytes, and every field of every frame is read by this.
template <typename T>
[[nodiscard]] inline T LoadLittleEndian(const std::uint8_t* at) {
  T value = 0;
  std::memcpy(&value, at, sizeof(T));
  return std::endian::native == std::endian::little ? value : SwapBytes(value);
}

/// Little-endian unsigned integer at `offset`; 0 when it does not fit (check with Fits() where that matters).
template <typename T>
[[nodiscard]] constexpr T LittleEndian(ByteSpan bytes, std::size_t offset) {
  static_assert(std::is_unsigned_v<T>);
  if (!Fits(bytes, offset, sizeof(T))) return 0;
  if (!std::is_constant_evaluated()) return LoadLittleEndian<T>(bytes.data() + offset);
  T value = 0;
  for (std::size_t i = sizeof(T); i-- > 0;) {
    value = static_cast<T>(static_cast<T>(value << (sizeof(T) > 1 ? 8 : 0)) | bytes[offset + i]);
  }
  return value;
}

/// All of `bytes` as one little-endian unsigned integer; of more than eight, the first eight.
[[nodiscard]] constexpr std::uint64_t UnsignedOf(ByteSpan bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 8; ++i) value |= std::uint64_t{bytes[i]} << (8 * i);
  return value;
}

/// Whether both hold the same; without a call where that is a number of four or eight bytes.
[[nodiscard]] inline bool SameBytes(ByteSpan a, ByteSpan b) {
  if (a.size() != b.size()) return false;
  if (a.size() == 8) return LoadLittleEndian<std::uint64_t>(a.data()) == LoadLittleEndian<std::uint64_t>(b.data());
  if (a.size() == 4) return LoadLittleEndian<std::uint32_t>(a.data()) == LoadLittleEndian<std::uint32_t>(b.data());
  return a.empty() || std::memcmp(a.data(), b.data(), a.size()) == 0;
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
  return SwapBytes(LittleEndian<T>(bytes, offset));
}

/// The part of `bytes` from `offset` on, at most `length` bytes; empty when `offset` is beyond the end.
[[nodiscard]] constexpr ByteSpan Slice(ByteSpan bytes, std::size_t offset,
                                       std::size_t length = static_cast<std::size_t>(-1)) {
  if (offset >= bytes.size()) return {};
  const std::size_t rest = bytes.size() - offset;
  return {bytes.data() + offset, length < rest ? length : rest};
}

}  // namespace ecaudit
