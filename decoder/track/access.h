/// out of bus/ and track/network: what one slave did with one datagram.
#pragma once

#include <algorithm>
#include <cstdint>

#include "decoder/base/bytes.h"
#include "decoder/base/event_sink.h"
#include "decoder/base/ids.h"
#include "decoder/wire/command.h"

namespace ecaudit::track {

/// Whether the slave took part in a datagram, as far as the capture shows.
enum class Acceptance : std::uint8_t {
  kAccepted,  ///< the working counter of the returned frame shows it
  kRefused,   ///< the frame returned and the slave did not count (mailbox full, register not implemented, ...)
  kUnknown,   ///< a broadcast that some slaves refused, or a frame that never returned
  kAssumed,   ///< only outbound frames are captured: taken as done
};

/// Whether `length` bytes from `address` on hold `byte`.
[[nodiscard]] inline bool CoversByte(EscAddress address, std::size_t length, EscAddress byte) {
  return address <= byte && static_cast<std::size_t>(byte - address) < length;
}

/// One access of the master to the memory of one slave. The spans are valid during the call that hands it over.
struct SlaveAccess {
  SlaveId slave = kNoSlave;
  FrameRef sent;      ///< the outbound copy; number 0 if it is not in the capture
  FrameRef returned;  ///< the returned copy; number 0 if it is not in the capture (yet)
  wire::Command command = wire::Command::NOP;
  std::uint8_t datagram = 0;  ///< ordinal in the frame
  EscAddress address = 0;     ///< first byte accessed
  ByteSpan written;           ///< what the master wrote; empty for a pure read
  ByteSpan read;              ///< what came back; empty for a pure write, a refused read, or when the return is missing
  Acceptance acceptance = Acceptance::kUnknown;
  bool broadcast = false;  ///< read data are the OR over all slaves

  /// The frame to cite: the returned copy where captured, else the outbound one.
  [[nodiscard]] const FrameRef& frame() const { return returned.seen() ? returned : sent; }
  [[nodiscard]] bool done() const { return acceptance == Acceptance::kAccepted || acceptance == Acceptance::kAssumed; }
  [[nodiscard]] std::size_t length() const { return std::max(written.size(), read.size()); }
  [[nodiscard]] MemoryRange range() const { return MemoryRange::Of(address, length()); }
  /// Bytes of `span` (written or read) from ESC address `at` on, empty unless `length` bytes there are covered.
  [[nodiscard]] ByteSpan Covered(ByteSpan span, EscAddress at, std::size_t length) const {
    if (at < address || !Fits(span, static_cast<std::size_t>(at - address), length)) return {};
    return span.subspan(static_cast<std::size_t>(at - address), length);
  }
};

/// The first 16 bit of `data`, or its only byte (old masters access AL registers with a length of 1); 0 when empty.
[[nodiscard]] inline std::uint16_t WordOrByte(ByteSpan data) {
  if (data.size() >= 2) return LittleEndian<std::uint16_t>(data, 0);
  return LittleEndian<std::uint8_t>(data, 0);
}

}  // namespace ecaudit::track
