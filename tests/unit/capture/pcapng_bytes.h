/// Builds pcapng files byte by byte, wrong ones as well.
#pragma once

#include <cstdint>
#include <string_view>

#include "tests/unit/capture/capture_test_support.h"

namespace ecaudit::capture {

class PcapngBytes {
 public:
  explicit PcapngBytes(bool big_endian = false) : big_endian_(big_endian) {}

  /// Integers in the byte order of the section.
  [[nodiscard]] Bytes Int(std::uint64_t value, std::size_t size) const {
    Bytes bytes;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t shift = 8 * (big_endian_ ? size - 1 - i : i);
      bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    }
    return bytes;
  }
  [[nodiscard]] Bytes U16(std::uint16_t value) const { return Int(value, 2); }
  [[nodiscard]] Bytes U32(std::uint32_t value) const { return Int(value, 4); }
  [[nodiscard]] Bytes U64(std::uint64_t value) const { return Int(value, 8); }

  static Bytes Join(std::initializer_list<Bytes> parts) {
    Bytes bytes;
    for (const Bytes& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
    return bytes;
  }
  static Bytes Pad(Bytes bytes) {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    return bytes;
  }
  [[nodiscard]] Bytes Option(std::uint16_t code, const Bytes& value) const {
    return Join({U16(code), U16(static_cast<std::uint16_t>(value.size())), Pad(value)});
  }
  [[nodiscard]] Bytes Option(std::uint16_t code, std::string_view value) const {
    return Option(code, Bytes(value.begin(), value.end()));
  }
  [[nodiscard]] Bytes EndOfOptions() const { return U32(0); }

  PcapngBytes& Raw(const Bytes& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  PcapngBytes& Block(std::uint32_t type, const Bytes& body) {
    const auto length = static_cast<std::uint32_t>(Pad(body).size() + 12);
    return Raw(Join({U32(type), U32(length), Pad(body), U32(length)}));
  }
  PcapngBytes& Section(const Bytes& options = {}, std::uint16_t major = 1) {
    return Block(0x0A0D0D0A, Join({U32(0x1A2B3C4D), U16(major), U16(0), U64(~0ULL), options}));
  }
  PcapngBytes& Interface(const Bytes& options = {}, std::uint16_t link_type = 1, std::uint32_t snap_length = 0) {
    return Block(1, Join({U16(link_type), U16(0), U32(snap_length), options}));
  }
  PcapngBytes& Enhanced(std::uint32_t interface, std::uint64_t ticks, const Bytes& data, const Bytes& options = {},
                        std::uint32_t original = 0) {
    const auto length = static_cast<std::uint32_t>(data.size());
    return Block(
        6, Join({U32(interface), U32(static_cast<std::uint32_t>(ticks >> 32U)), U32(static_cast<std::uint32_t>(ticks)),
                 U32(length), U32(original == 0 ? length : original), Pad(data), options}));
  }
  PcapngBytes& Simple(const Bytes& data, std::uint32_t original) { return Block(3, Join({U32(original), Pad(data)})); }
  PcapngBytes& Obsolete(std::uint16_t interface, std::uint16_t drops, std::uint64_t ticks, const Bytes& data,
                        const Bytes& options = {}) {
    const auto length = static_cast<std::uint32_t>(data.size());
    return Block(2, Join({U16(interface), U16(drops), U32(static_cast<std::uint32_t>(ticks >> 32U)),
                          U32(static_cast<std::uint32_t>(ticks)), U32(length), U32(length), Pad(data), options}));
  }
  PcapngBytes& Statistics(std::uint32_t interface, const Bytes& options) {
    return Block(5, Join({U32(interface), U32(0), U32(0), options}));
  }

  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  bool big_endian_;
  Bytes bytes_;
};

}  // namespace ecaudit::capture
