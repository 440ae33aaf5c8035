/// Writing and reading integers in byte vectors. The sample builder has its own, so that it shares no parsing code with
/// the decoder it is meant to test.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace ecaudit::samples {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// Appends `value`, least significant byte first.
template <typename T>
void AppendLe(Bytes& out, T value) {
  auto rest = std::uint64_t{static_cast<std::make_unsigned_t<T>>(value)};
  for (std::size_t i = 0; i < sizeof(T); ++i, rest >>= 8U) out.push_back(static_cast<std::uint8_t>(rest & 0xFFU));
}

/// Appends `value`, most significant byte first.
template <typename T>
void AppendBe(Bytes& out, T value) {
  for (std::size_t i = sizeof(T); i-- > 0;) {
    out.push_back(static_cast<std::uint8_t>((static_cast<std::uint64_t>(value) >> (8U * i)) & 0xFFU));
  }
}

inline void AppendBytes(Bytes& out, ByteView bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}
inline void AppendText(Bytes& out, std::string_view text) {
  out.insert(out.end(), text.begin(), text.end());
}

/// Stores `value` little endian at `offset`; bytes behind the end of `out` are left out.
template <typename T>
void StoreLe(std::span<std::uint8_t> out, std::size_t offset, T value) {
  for (std::size_t i = 0; i < sizeof(T) && offset + i < out.size(); ++i) {
    out[offset + i] = static_cast<std::uint8_t>((static_cast<std::uint64_t>(value) >> (8U * i)) & 0xFFU);
  }
}

/// Reads a little-endian integer; bytes behind the end count as 0.
template <typename T>
[[nodiscard]] T LoadLe(ByteView in, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T) && offset + i < in.size(); ++i) {
    value |= static_cast<std::uint64_t>(in[offset + i]) << (8U * i);
  }
  return static_cast<T>(value);
}

/// The bytes of one little-endian integer.
template <typename T>
[[nodiscard]] Bytes LeBytes(T value) {
  Bytes out;
  AppendLe(out, value);
  return out;
}

}  // namespace ecaudit::samples
