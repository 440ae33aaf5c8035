/// Names for the numbers that travel through every stage.
#pragma once

#include <cstdint>

namespace ecaudit {

/// Wireshark's frame.number: 1 for the first packet of the file, EtherCAT or not; 0 means "no frame".
using FrameNo = std::uint64_t;
/// Nanoseconds; as a point in time, since 1970-01-01 00:00 UTC.
using TimeNs = std::int64_t;
/// Dense number of a slave inside one analysis, in order of discovery. Reports show positions instead.
using SlaveId = std::uint16_t;
/// Place on the bus, 0 for the slave next to the master.
using SlavePos = std::uint16_t;
/// Configured station address (register 0x0010) or alias (0x0012).
using StationAddress = std::uint16_t;
/// Address in the memory of an ESC, 0x0000-0xFFFF.
using EscAddress = std::uint16_t;

inline constexpr SlaveId kNoSlave = 0xFFFF;

/// A frame as an event or finding cites it. `number` 0: that copy of the frame is not in the capture.
struct FrameRef {
  FrameNo number = 0;
  TimeNs time = 0;        ///< capture clock; meaningless unless has_time
  bool has_time = false;  ///< false for pcapng simple packet blocks

  [[nodiscard]] bool seen() const { return number != 0; }
  bool operator==(const FrameRef&) const = default;
};

}  // namespace ecaudit
