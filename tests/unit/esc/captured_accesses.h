/// The accesses to one slave in a pcapng file, cut by hand, so that these tests do not rest on the stages before them.
#pragma once

#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/track/access.h"

namespace ecaudit::test {

/// Hands over each datagram of the returned frames (bit 1 of the source MAC set, plain Ethernet, little-endian file)
/// that `of_slave` takes and whose working counter is not 0.
/// @param of_slave (command, first half of the address as returned) -> is it an access to the slave meant
/// @return false when the file cannot be read
inline bool ForEachAccess(const std::string& path, const std::function<bool(wire::Command, std::uint16_t)>& of_slave,
                          const std::function<void(const track::SlaveAccess&)>& visit) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (bytes.empty()) return false;
  FrameNo number = 0;
  for (std::size_t block = 0; Fits(bytes, block, 12);) {
    const std::size_t length = LittleEndian<std::uint32_t>(bytes, block + 4);
    if (length < 12 || !Fits(bytes, block, length)) return false;
    if (LittleEndian<std::uint32_t>(bytes, block) == 6) {
      ++number;
      const ByteSpan packet = Slice(bytes, block + 28, LittleEndian<std::uint32_t>(bytes, block + 20));
      const bool returned =
          packet.size() > 28 && (packet[6] & 2U) != 0 && BigEndian<std::uint16_t>(packet, 12) == 0x88A4;
      const std::size_t end = 16U + (LittleEndian<std::uint16_t>(packet, 14) & 0x07FFU);
      for (std::size_t at = 16; returned && at + 12 <= end && at + 12 <= packet.size();) {
        const std::size_t data = LittleEndian<std::uint16_t>(packet, at + 6) & 0x07FFU;
        const auto command = static_cast<wire::Command>(packet[at]);
        const std::uint16_t wkc = LittleEndian<std::uint16_t>(packet, at + 10 + data);
        if (!wire::IsLogical(command) && wkc != 0 && of_slave(command, LittleEndian<std::uint16_t>(packet, at + 2))) {
          track::SlaveAccess access;
          access.slave = 0;
          access.returned.number = number;
          access.command = command;
          access.address = LittleEndian<std::uint16_t>(packet, at + 4);
          if (wire::Writes(command)) access.written = Slice(packet, at + 10, data);
          if (wire::Reads(command)) access.read = Slice(packet, at + 10, data);
          access.broadcast = wire::IsBroadcast(command);
          access.acceptance = track::Acceptance::kAccepted;
          visit(access);
        }
        at += 12 + data;
      }
    }
    block += length;
  }
  return true;
}

}  // namespace ecaudit::test
