/// Capture files in memory: pcapng and pcap, in the variants that readers must cope with.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/wire_bytes.h"

namespace ecaudit::samples {

enum class PacketDirection : std::uint8_t { kNotRecorded, kInbound, kOutbound };

struct WrittenPacket {
  Bytes bytes{};
  TimeNs time = 0;                    ///< ns since 1970 UTC; rounded down to the resolution of the file
  std::uint32_t interface_index = 0;  ///< pcapng only
  PacketDirection direction = PacketDirection::kNotRecorded;  ///< pcapng only (epb_flags)
  std::string comment{};                                      ///< pcapng only
  std::uint32_t original_length = 0;                          ///< 0: as long as `bytes`
  bool simple = false;  ///< pcapng only: a simple packet block, without time stamp
};

struct WrittenInterface {
  std::string name{};
  std::uint16_t link_type = 1;
  std::uint32_t snap_length = 0;           ///< 0: unlimited
  std::uint8_t resolution = 9;             ///< if_tsresol: stamps count 10^-resolution seconds, 0-9
  std::optional<std::uint64_t> dropped{};  ///< writes an interface statistics block at the end
};

struct WrittenCapture {
  std::vector<WrittenInterface> interfaces{WrittenInterface{}};
  std::vector<WrittenPacket> packets{};
  std::string comment{};  ///< pcapng only
};

enum class ByteOrder : std::uint8_t { kLittle, kBig };

/// One section with one enhanced (or simple) packet block per packet.
[[nodiscard]] Bytes EncodePcapNg(const WrittenCapture& capture, ByteOrder order = ByteOrder::kLittle);
/// Classic pcap with the link type and snap length of the first interface.
/// @param nanoseconds  magic number and stamps of the nanosecond variant instead of microseconds
[[nodiscard]] Bytes EncodePcap(const WrittenCapture& capture, bool nanoseconds, ByteOrder order = ByteOrder::kLittle);

/// The packets alone, to be written behind a file of the same kind and interfaces that was begun without any: captures
/// longer than memory are written piece by piece.
[[nodiscard]] Bytes EncodePcapNgPackets(const WrittenCapture& capture, ByteOrder order = ByteOrder::kLittle);
[[nodiscard]] Bytes EncodePcapPackets(const WrittenCapture& capture, bool nanoseconds,
                                      ByteOrder order = ByteOrder::kLittle);

}  // namespace ecaudit::samples
