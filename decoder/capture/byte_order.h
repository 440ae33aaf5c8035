/// Numbers of a capture file, which has the byte order of the machine that wrote it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "decoder/base/bytes.h"

namespace ecaudit::capture {

struct ByteOrder {
  bool big_endian = false;

  [[nodiscard]] std::uint16_t U16(ByteSpan bytes, std::size_t offset) const {
    return big_endian ? BigEndian<std::uint16_t>(bytes, offset) : LittleEndian<std::uint16_t>(bytes, offset);
  }
  [[nodiscard]] [[gnu::always_inline]] std::uint32_t U32(ByteSpan bytes, std::size_t offset) const {
    return big_endian ? BigEndian<std::uint32_t>(bytes, offset) : LittleEndian<std::uint32_t>(bytes, offset);
  }
  /// Where four bytes are known to be.
  [[nodiscard]] std::uint32_t At(const std::uint8_t* at) const {
    const auto value = LoadLittleEndian<std::uint32_t>(at);
    return big_endian ? SwapBytes(value) : value;
  }
  [[nodiscard]] std::uint64_t U64(ByteSpan bytes, std::size_t offset) const {
    return big_endian ? BigEndian<std::uint64_t>(bytes, offset) : LittleEndian<std::uint64_t>(bytes, offset);
  }
};

}  // namespace ecaudit::capture
