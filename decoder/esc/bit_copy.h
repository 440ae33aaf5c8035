/// Copies runs of bits between byte buffers, bit 0 of a byte first, as FMMUs do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "decoder/base/bytes.h"

namespace ecaudit::esc {

/// Copies `count` bits from bit `from_bit` of `from` to bit `to_bit` of `to`; the other bits of `to` stay. The buffers
/// must not overlap.
/// @return false, with nothing copied, when the bits do not lie inside both buffers
inline bool CopyBits(ByteSpan from, std::uint64_t from_bit, std::span<std::uint8_t> to, std::uint64_t to_bit,
                     std::uint64_t count) {
  const std::uint64_t from_bits = std::uint64_t{from.size()} * 8;
  const std::uint64_t to_bits = std::uint64_t{to.size()} * 8;
  if (from_bit > from_bits || count > from_bits - from_bit || to_bit > to_bits || count > to_bits - to_bit)
    return false;
  if (from_bit % 8 == 0 && to_bit % 8 == 0) {
    const std::size_t whole = static_cast<std::size_t>(count / 8);
    if (whole != 0) std::memcpy(to.data() + to_bit / 8, from.data() + from_bit / 8, whole);
    from_bit += std::uint64_t{whole} * 8;
    to_bit += std::uint64_t{whole} * 8;
    count -= std::uint64_t{whole} * 8;
  }
  for (; count != 0; --count, ++from_bit, ++to_bit) {
    const unsigned bit = from[static_cast<std::size_t>(from_bit / 8)] >> (from_bit % 8) & 1U;
    std::uint8_t& target = to[static_cast<std::size_t>(to_bit / 8)];
    const unsigned mask = 1U << (to_bit % 8);
    target = static_cast<std::uint8_t>(bit != 0 ? target | mask : target & ~mask);
  }
  return true;
}

}  // namespace ecaudit::esc
